# Debian's cross compilers: presets arm64 and armhf, in a Debian that has crossbuild-essential-ARCH and
# the libraries of that architecture (tools/build-root makes one). SWARMTALK_TRIPLET: its GNU name.
set(CMAKE_SYSTEM_NAME Linux)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SWARMTALK_TRIPLET)
string(REGEX REPLACE "-.*" "" CMAKE_SYSTEM_PROCESSOR ${SWARMTALK_TRIPLET})
set(CMAKE_C_COMPILER ${SWARMTALK_TRIPLET}-gcc)
set(CMAKE_CXX_COMPILER ${SWARMTALK_TRIPLET}-g++)
set(CMAKE_LIBRARY_ARCHITECTURE ${SWARMTALK_TRIPLET})
set(PKG_CONFIG_EXECUTABLE ${SWARMTALK_TRIPLET}-pkg-config CACHE FILEPATH "pkg-config")
# Programs that run while building, protoc above all, are this machine's.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
