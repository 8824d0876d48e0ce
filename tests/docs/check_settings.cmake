# Whether the tables in a Markdown file are what `ipl_slam config --markdown` prints today. They stand between two
# marker comments; with -DWRITE=ON they are written anew instead (`./dev docs`).
#   cmake -DPROGRAM=... -DFILE=docs/settings.md [-DWRITE=ON] -P check_settings.cmake
cmake_minimum_required(VERSION 3.25)

set(begin "<!-- begin of the output of: ipl_slam config --markdown -->\n")
set(end "<!-- end of the output -->\n")

execute_process(COMMAND ${PROGRAM} config --markdown OUTPUT_VARIABLE tables RESULT_VARIABLE result)
if(NOT result EQUAL 0 OR tables STREQUAL "")
  message(FATAL_ERROR "${PROGRAM} config --markdown failed: ${result}")
endif()

file(READ ${FILE} text)
string(FIND "${text}" "${begin}" at_begin)
string(FIND "${text}" "${end}" at_end)
if(at_begin LESS 0 OR at_end LESS at_begin)
  message(FATAL_ERROR "${FILE} lacks the lines between which the tables stand:\n${begin}${end}")
endif()
string(SUBSTRING "${text}" 0 ${at_begin} head)
string(SUBSTRING "${text}" ${at_end} -1 tail)
set(wanted "${head}${begin}\n${tables}\n${tail}")

if(wanted STREQUAL text)
  message(STATUS "${FILE} is up to date")
elseif(WRITE)
  file(WRITE ${FILE} "${wanted}")
  message(STATUS "${FILE}: tables written anew")
else()
  message(FATAL_ERROR "${FILE} does not show the program's settings as they are; run ./dev docs")
endif()
