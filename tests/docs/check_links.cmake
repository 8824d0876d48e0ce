# Whether every file that README.md and docs/*.md link to, and every source file that they name, is there.
#   cmake -DSOURCE_DIR=... -P check_links.cmake
cmake_minimum_required(VERSION 3.25)

file(GLOB pages ${SOURCE_DIR}/README.md ${SOURCE_DIR}/docs/*.md)
set(broken "")
set(count 0)
foreach(page IN LISTS pages)
  cmake_path(GET page PARENT_PATH folder)
  file(READ ${page} text)
  string(REPLACE "](" "@(" text "${text}")
  string(REGEX REPLACE "[][;]" " " text "${text}")  # these would end or split CMake's list items

  string(REGEX MATCHALL "@\\([A-Za-z0-9_./-]+(#[a-z0-9-]+)?\\)" targets "${text}")
  list(TRANSFORM targets REPLACE "^@\\(|(#[a-z0-9-]+)?\\)$" "")
  list(TRANSFORM targets PREPEND ${folder}/)
  string(REGEX MATCHALL "(src|apps|include|tests|bench|examples)/[a-z0-9_/]+\\.(hpp|cpp|cmake|sh)" sources "${text}")
  list(TRANSFORM sources PREPEND ${SOURCE_DIR}/)

  foreach(target IN LISTS targets sources)
    math(EXPR count "${count} + 1")
    if(NOT EXISTS ${target})
      string(APPEND broken "\n  ${page}: ${target}")
    endif()
  endforeach()
endforeach()
if(broken)
  message(FATAL_ERROR "files that are not there:${broken}")
endif()
if(count EQUAL 0)
  message(FATAL_ERROR "no link was found in ${SOURCE_DIR}: the check does not work")
endif()
