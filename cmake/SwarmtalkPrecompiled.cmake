# The standard library's headers, which most sources include, read once (GCC's or clang's precompiled header).
# Only where the preset asks for it: a source that lacks an include compiles all the same.
if(NOT SWARMTALK_PRECOMPILED_HEADERS)
  return()
endif()
set(CMAKE_CXX_COMPILE_OPTIONS_PIE -fPIC)  # one header for libraries and programs
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/standard_headers.cpp CONTENT "")
add_library(swarmtalk_standard_headers OBJECT ${PROJECT_BINARY_DIR}/standard_headers.cpp)
swarmtalk_warnings(swarmtalk_standard_headers)
target_precompile_headers(swarmtalk_standard_headers PRIVATE
  <algorithm> <array> <chrono> <cmath> <cstdint> <cstdio> <cstring> <deque> <filesystem> <fstream> <functional>
  <map> <memory> <optional> <set> <span> <sstream> <stdexcept> <string> <string_view> <unordered_map> <utility>
  <vector>)
