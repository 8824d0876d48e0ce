#pragma once

namespace ipl_slam {

/// From here on the first Ctrl-C (SIGINT) or SIGTERM does not end the process but makes interrupted() true,
/// so that a loop can stop and write what it has. The second one ends the process at once, as if there were
/// no handler. Only for verbs that ask interrupted() in their loop; the others are rightly ended by the first
/// Ctrl-C.
void install_interrupt_handler();

/// Whether a signal came since the handler was installed.
[[nodiscard]] bool interrupted();

}  // namespace ipl_slam
