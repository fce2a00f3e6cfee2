# What makes a fault in our code harder to use, in every optimised build: Debian's hardening=+all,
# and checks of the standard library's preconditions. What it costs: docs/benchmarks.md. Sanitizers
# check more and do not go with it; SWARMTALK_HARDENING=OFF is for measuring only.
include(CheckPIESupported)
check_pie_supported()

# For what measures our code without the compiler's checks.
set(SWARMTALK_UNHARDENED "")
option(SWARMTALK_HARDENING "Compile with stack protector, FORTIFY, immediate binding and the like" ON)
if(NOT SWARMTALK_HARDENING OR SWARMTALK_SANITIZE)
  return()
endif()

set(SWARMTALK_UNHARDENED -fno-stack-protector -fno-stack-clash-protection -U_GLIBCXX_ASSERTIONS)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|amd64|AMD64|i[3-6]86)$")
  list(APPEND SWARMTALK_UNHARDENED -fcf-protection=none)
endif()

set(optimised $<NOT:$<CONFIG:Debug>>)
add_compile_options(-fstack-protector-strong -fstack-clash-protection)
if(NOT CMAKE_CXX_FLAGS MATCHES "_FORTIFY_SOURCE")  # a distribution's own level stays
  add_compile_options($<${optimised}:-U_FORTIFY_SOURCE> $<${optimised}:-D_FORTIFY_SOURCE=2>)
endif()
add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-D_GLIBCXX_ASSERTIONS>)
add_link_options(-Wl,-z,relro -Wl,-z,now)

# Jumps and returns that go astray end the program, where the processor can tell.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|amd64|AMD64|i[3-6]86)$")
  add_compile_options(-fcf-protection)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
  add_compile_options(-mbranch-protection=standard)
endif()
