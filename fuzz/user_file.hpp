#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include <ipl_slam/error.hpp>

#include "dataset/temporary_folder.hpp"

namespace ipl_slam::fuzz {

/// The input as a file of that name, in a folder that stays the same.
inline std::filesystem::path user_file(const std::string& name, const std::uint8_t* data, std::size_t size) {
  static const testing::TemporaryFolder folder;
  return folder.write(name, {reinterpret_cast<const char*>(data), size});
}

/// What is read may be refused, in one line; anything else that is thrown ends the fuzzer.
template <class Read>
void read_or_refuse(const Read& read) {
  try {
    read();
  } catch (const UserError& error) {
    const std::string_view message = error.what();
    if (message.empty() || message.find('\n') != std::string_view::npos) std::abort();
  }
}

}  // namespace ipl_slam::fuzz
