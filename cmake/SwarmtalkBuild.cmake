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

# Warnings for our own targets; generated code (protobuf) does not get them.
function(swarmtalk_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
    -Wnon-virtual-dtor -Wold-style-cast -Wcast-qual -Werror=return-type)
endfunction()

# Includes are written from the repository's root ("drivers/link.hpp"), so the folder an include
# points to can be read off the line; tools/check holds the table of who may include whom.
function(swarmtalk_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  target_link_libraries(${name} PUBLIC ${arg_DEPENDS})
  swarmtalk_warnings(${name})
endfunction()

# swarmtalk_test(NAME SOURCES... DEPENDS...): one GoogleTest program, its tests known to ctest.
function(swarmtalk_test name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS;LABELS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})
  target_link_libraries(${name} PRIVATE ${arg_DEPENDS} GTest::gtest GTest::gmock GTest::gtest_main)
  swarmtalk_warnings(${name})
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT 120 LABELS "${arg_LABELS}")
endfunction()
