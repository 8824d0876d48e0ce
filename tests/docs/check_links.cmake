# Whether every file that README.md and docs/*.md point to is there.
#   cmake -DSOURCE_DIR=... -P check_links.cmake
cmake_minimum_required(VERSION 3.25)

file(GLOB pages ${SOURCE_DIR}/README.md ${SOURCE_DIR}/docs/*.md)
set(broken "")
set(count 0)
foreach(page IN LISTS pages)
  cmake_path(GET page PARENT_PATH folder)
  file(READ ${page} text)
  string(REGEX REPLACE "[][;]" " " text "${text}")  # these would end or split CMake's list items
  string(REGEX MATCHALL "\\([A-Za-z0-9_./-]+(#[a-z0-9-]+)?\\)" links "${text}")
  foreach(link IN LISTS links)
    string(REGEX REPLACE "^\\(|(#[a-z0-9-]+)?\\)$" "" target "${link}")
    if(NOT target MATCHES "[./]")  # a word in brackets, no link
      continue()
    endif()
    math(EXPR count "${count} + 1")
    if(NOT EXISTS ${folder}/${target})
      string(APPEND broken "\n  ${page}: ${target}")
    endif()
  endforeach()
endforeach()
if(broken)
  message(FATAL_ERROR "links to files that are not there:${broken}")
endif()
if(count EQUAL 0)
  message(FATAL_ERROR "no link was found in ${SOURCE_DIR}: the check does not work")
endif()
