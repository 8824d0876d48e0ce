#include "loop/place_index.hpp"
