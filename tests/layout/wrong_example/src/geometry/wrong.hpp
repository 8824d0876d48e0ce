#pragma once

// Not part of the project: what the include check must refuse.
#include "map/map.hpp"
