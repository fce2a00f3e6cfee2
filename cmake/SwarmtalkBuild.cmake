# Language level, warnings and sanitizers that every target of ours gets.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

if(CMAKE_SIZEOF_VOID_P EQUAL 4)  # files beyond 2 GiB, as a recording may become
  add_compile_definitions(_FILE_OFFSET_BITS=64)
endif()

if(PROJECT_IS_TOP_LEVEL)  # else the other project decides
  set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
  if(NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
  endif()
  find_program(SWARMTALK_CCACHE ccache)
  if(SWARMTALK_CCACHE)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${SWARMTALK_CCACHE})
    set(CMAKE_C_COMPILER_LAUNCHER ${SWARMTALK_CCACHE})
  endif()
endif()

foreach(sanitizer IN LISTS SWARMTALK_SANITIZE)
  add_compile_options(-fsanitize=${sanitizer} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${sanitizer})
endforeach()
if("undefined" IN_LIST SWARMTALK_SANITIZE)
  add_compile_options(-fno-sanitize-recover=undefined)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND "address" IN_LIST SWARMTALK_SANITIZE)
    # These two cost 14 % more of the compiler's time: nine objects in pairs, twice each, 97 s without
    # and 111 s with them. Where a null pointer is used the program ends without them as well; the
    # preset fuzz (clang) has them.
    add_compile_options(-fno-sanitize=null,vptr)
  endif()
endif()

# Several sources compiled as one where the preset asks for it: headers, and templates under
# sanitizers, cost most of a build. The presets release and debug compile each source by itself, so a
# Raspberry Pi's memory is enough; a test of tests/compilers does so as well, so that a missing
# include shows.
# CMake's own joined files (UNITY_BUILD) name sources by their whole path, so that a compiler's cache finds
# nothing for the same tree in another folder; ours name them from the repository's root.
function(swarmtalk_join_sources target)
  if(SWARMTALK_JOIN_SOURCES)
    cmake_language(EVAL CODE "cmake_language(DEFER CALL swarmtalk_join_sources_of ${target})")
  endif()
endfunction()

# When all of a folder's sources and their properties are known: twelve sources in a file.
function(swarmtalk_join_sources_of target)
  get_target_property(sources ${target} SOURCES)
  get_target_property(is_apart ${target} SWARMTALK_NOT_JOINED)
  if(is_apart)
    return()
  endif()
  set(joined "")
  set(others "")
  foreach(source IN LISTS sources)
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE
      OUTPUT_VARIABLE path)
    cmake_path(IS_PREFIX PROJECT_SOURCE_DIR ${path} is_ours)
    cmake_path(IS_PREFIX PROJECT_BINARY_DIR ${path} is_made)
    set(is_apart FALSE)
    foreach(property SWARMTALK_NOT_JOINED COMPILE_OPTIONS COMPILE_DEFINITIONS COMPILE_FLAGS)
      get_source_file_property(value ${source} ${property})
      if(value)
        set(is_apart TRUE)
      endif()
    endforeach()
    if(source MATCHES "\\.cpp$" AND is_ours AND NOT is_made AND NOT is_apart)
      cmake_path(RELATIVE_PATH path BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
      list(APPEND joined ${path})
    else()
      list(APPEND others ${source})
    endif()
  endforeach()
  list(LENGTH joined count)
  if(count LESS 2)
    return()
  endif()
  math(EXPR last "${count} - 1")
  foreach(first RANGE 0 ${last} 12)
    list(SUBLIST joined ${first} 12 some)
    if(some)
      list(TRANSFORM some REPLACE "(.+)" "#include \"\\1\"\n")
      string(CONCAT text ${some})
      set(file ${CMAKE_CURRENT_BINARY_DIR}/joined/${target}_${first}.cpp)
      file(CONFIGURE OUTPUT ${file} CONTENT "${text}" @ONLY)
      list(APPEND others ${file})
    endif()
  endforeach()
  set_property(TARGET ${target} PROPERTY SOURCES ${others})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
endfunction()

# For our own targets: warnings, which generated code (protobuf) does not get, and joined sources. Inside
# another project they have none: its -Werror is for its own code.
function(swarmtalk_warnings target)
  swarmtalk_join_sources(${target})
  if(NOT PROJECT_IS_TOP_LEVEL)
    target_compile_options(${target} PRIVATE -w)
    return()
  endif()
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
    -Wnon-virtual-dtor -Wold-style-cast -Wcast-qual -Werror=return-type)
  if(TARGET swarmtalk_standard_headers AND NOT target STREQUAL swarmtalk_standard_headers)
    target_precompile_headers(${target} REUSE_FROM swarmtalk_standard_headers)
  endif()
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
  if(NOT clock STREQUAL "*" AND SWARMTALK_SANITIZE)
    swarmtalk_shards(${name} "*-${clock}")
    swarmtalk_sanitized(${name})
  elseif(NOT clock STREQUAL "*")
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

# swarmtalk_shards(PROGRAM FILTER): its tests in a few processes instead of one for each, because with
# sanitizers a third of a second goes by before a test begins. tools/test_results.py counts them by the
# report that GoogleTest writes.
function(swarmtalk_shards program filter)
  foreach(shard RANGE 3)
    set(test Sanitized.${program}.${shard})
    add_test(NAME ${test} COMMAND ${program} --gtest_filter=${filter}
      --gtest_output=xml:${PROJECT_BINARY_DIR}/Testing/pytest/${test}.xml)
    set_tests_properties(${test} PROPERTIES TIMEOUT 900 LABELS logic
      ENVIRONMENT "RC_PARAMS=seed=1;GTEST_TOTAL_SHARDS=4;GTEST_SHARD_INDEX=${shard}")
  endforeach()
endfunction()

# swarmtalk_sanitized(PROGRAM): a program that tools/test --sanitize builds.
function(swarmtalk_sanitized program)
  if(NOT TARGET sanitized)
    add_custom_target(sanitized)
  endif()
  add_dependencies(sanitized ${program})
endfunction()
