# Language level, warnings and sanitizers that every target of ours gets.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
endif()

find_program(SWARMTALK_CCACHE ccache)
if(SWARMTALK_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SWARMTALK_CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${SWARMTALK_CCACHE})
endif()

foreach(sanitizer IN LISTS SWARMTALK_SANITIZE)
  add_compile_options(-fsanitize=${sanitizer} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${sanitizer})
endforeach()
if("undefined" IN_LIST SWARMTALK_SANITIZE)
  add_compile_options(-fno-sanitize-recover=undefined)
endif()

# Several sources compiled as one where the preset asks for it: headers, and templates under
# sanitizers, cost most of a build. The presets release and debug compile each source by itself, so a
# Raspberry Pi's memory is enough; a test of tests/compilers does so as well, so that a missing
# include shows.
function(swarmtalk_join_sources target)
  if(SWARMTALK_JOIN_SOURCES)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 12)
  endif()
endfunction()

# For our own targets: warnings, which generated code (protobuf) does not get, and joined sources.
function(swarmtalk_warnings target)
  swarmtalk_join_sources(${target})
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
    -Wnon-virtual-dtor -Wold-style-cast -Wcast-qual -Werror=return-type)
endfunction()

# Includes are written from the repository's root ("drivers/link/link.hpp"), so the folder an include
# points to can be read off the line; tools/check holds the table of who may include whom.
function(swarmtalk_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  target_link_libraries(${name} PUBLIC ${arg_DEPENDS})
  swarmtalk_warnings(${name})
endfunction()

# swarmtalk_test(NAME [NOT_OPTIMISED] [CLOCK FILTERS...] SOURCES... DEPENDS...): one GoogleTest program, its
# tests known to ctest; rapidcheck draws from a fixed seed there, and from another each time where the program is
# started by hand. They are of kind `logic`, but those that match a filter of CLOCK (as --gtest_filter has
# them), which are of kind `clock`; the others run under sanitizers as well.
# NOT_OPTIMISED: its own sources are compiled without optimisation, which takes half of the time;
# the libraries that it tests are optimised as ever. Not for tests of templates, nor for those that compute.
function(swarmtalk_test name)
  cmake_parse_arguments(arg "NOT_OPTIMISED" "" "SOURCES;DEPENDS;CLOCK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})
  target_link_libraries(${name} PRIVATE ${arg_DEPENDS} GTest::gtest GTest::gmock GTest::gtest_main)
  swarmtalk_warnings(${name})
  if(arg_NOT_OPTIMISED)
    target_compile_options(${name} PRIVATE -O0 -U_FORTIFY_SOURCE)
  endif()
  set(properties PROPERTIES TIMEOUT 120 ENVIRONMENT "RC_PARAMS=seed=1" LABELS)
  list(JOIN arg_CLOCK ":" clock)
  if(NOT clock STREQUAL "*")
    gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 TEST_FILTER "*-${clock}"
      ${properties} logic)
    swarmtalk_sanitized(${name})
  endif()
  if(clock)
    gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 TEST_FILTER "${clock}" TEST_LIST ${name}_CLOCK
      ${properties} clock)
  endif()
  set_property(GLOBAL APPEND PROPERTY SWARMTALK_TEST_PROGRAMS ${name})
endfunction()

# swarmtalk_sanitized(PROGRAM): a program that tools/test --sanitize builds.
function(swarmtalk_sanitized program)
  if(NOT TARGET sanitized)
    add_custom_target(sanitized)
  endif()
  add_dependencies(sanitized ${program})
endfunction()

# swarmtalk_pytest(PREFIX KIND [BY_FILE] [ENVIRONMENT...] [NEEDS TARGETS...]): the pytest files of this
# folder, of a kind where they are not marked with another (tests/support/kinds.py).
# Each of pytest's tests is one of ctest's, so that what is skipped is counted as skipped; -rs prints
# the reason. NEEDS: what has to be built before they run, for tools/test -R and --changed; targets that
# are not there are left out.
# BY_FILE: each file is one of ctest's tests, where all tests in it share what takes long to make.
function(swarmtalk_pytest prefix kind)
  cmake_parse_arguments(arg "BY_FILE" "" "NEEDS" ${ARGN})
  find_program(PYTHON3 python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  set(environment "SWARMTALK_BUILD=${PROJECT_BINARY_DIR}" "PYTHONDONTWRITEBYTECODE=1"
    ${arg_UNPARSED_ARGUMENTS})
  set(support ${PROJECT_SOURCE_DIR}/tests/support)
  file(GLOB scripts CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.py)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${scripts})
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env ${environment} SWARMTALK_COLLECTING=1 SWARMTALK_KIND=${kind}
      PYTHONPATH=${support} ${PYTHON3} -m pytest -qq -s --collect-only -p no:cacheprovider -p kinds .
    WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}
    OUTPUT_VARIABLE collected RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "pytest cannot collect ${CMAKE_CURRENT_SOURCE_DIR}:\n${collected}")
  endif()
  # "KIND: FOLDER/test_NAME.py::test_NAME[VALUES]"
  get_filename_component(folder ${CMAKE_CURRENT_SOURCE_DIR} NAME)
  foreach(each IN ITEMS logic clock field)
    string(REGEX MATCHALL "\n${each}: [^\n]*test_[a-z_0-9]+\\.py::[^\n]+" found "\n${collected}")
    list(TRANSFORM found REPLACE ".*/(test_[a-z_0-9]+\\.py::)" "\\1")
    if(arg_BY_FILE)
      list(TRANSFORM found REPLACE "::.*" "")
      list(REMOVE_DUPLICATES found)
    endif()
    foreach(test IN LISTS found)
      swarmtalk_add_pytest(${prefix} ${each} "${test}" "${environment}")
    endforeach()
  endforeach()
  swarmtalk_pytest_needs("" ${arg_NEEDS})
endfunction()

# For swarmtalk_pytest: TEST is a file of pytest's, or one test in it.
function(swarmtalk_add_pytest prefix kind test environment)
  string(REGEX REPLACE "^test_(.*)\\.py::test_" "${prefix}.\\1." name "${test}")
  string(REGEX REPLACE "^test_(.*)\\.py$" "${prefix}.\\1" name "${name}")
  # A folder of its own for each: pytest's common one is cleared by tests that run beside it. A
  # short one: the path of a Unix socket has at most 107 bytes.
  string(MD5 own "${PROJECT_BINARY_DIR}/${name}")
  string(SUBSTRING ${own} 0 8 own)
  add_test(NAME "${name}" COMMAND ${PYTHON3} -m pytest -q -rs -s -p no:cacheprovider
    --basetemp=/tmp/swarmtalk-test-${own} "${test}"
    WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
  # Those of kind `field` have limits of their own, up to those of an hour of soak.
  set(limit_s 300)
  if(kind STREQUAL field)
    set(limit_s 7200)
  endif()
  # A file is skipped if all tests in it are.
  set_tests_properties("${name}" PROPERTIES TIMEOUT ${limit_s} LABELS ${kind}
    ENVIRONMENT "${environment}" SKIP_REGULAR_EXPRESSION "\n[0-9]+ skipped in ")
endfunction()

# swarmtalk_pytest_needs(SCRIPT TARGETS...): what one script of this folder needs, instead of what the
# others need.
function(swarmtalk_pytest_needs script)
  list(JOIN ARGN " " needs)
  cmake_path(APPEND CMAKE_CURRENT_SOURCE_DIR "${script}" OUTPUT_VARIABLE path)
  string(REGEX REPLACE "/$" "" path ${path})
  set_property(GLOBAL APPEND PROPERTY SWARMTALK_TEST_NEEDS "${path} ${needs}")
endfunction()

# Called when all targets are known: writes, for tools/test -R and --changed, the GoogleTest programs
# and what each folder of pytest's needs.
function(swarmtalk_write_test_lists)
  get_property(programs GLOBAL PROPERTY SWARMTALK_TEST_PROGRAMS)
  get_property(folders GLOBAL PROPERTY SWARMTALK_TEST_NEEDS)
  set(lines "")
  foreach(folder IN LISTS folders)
    separate_arguments(words UNIX_COMMAND "${folder}")
    list(POP_FRONT words path)
    foreach(target IN LISTS words)
      if(NOT TARGET ${target})
        list(REMOVE_ITEM words ${target})
      endif()
    endforeach()
    list(JOIN words " " words)
    string(APPEND lines "${path} ${words}\n")
  endforeach()
  list(JOIN programs "\n" programs)
  file(WRITE ${PROJECT_BINARY_DIR}/test_programs.txt "${programs}\n")
  file(WRITE ${PROJECT_BINARY_DIR}/test_needs.txt "${lines}")
endfunction()
