#include "loop/place_index.hpp"

#include <gtest/gtest.h>
