# Finds ARGoS 3 and makes modules of programs for its robots. In this tree and in others:
#
#   include(.../platforms/argos/SwarmtalkArgos.cmake)
#   swarmtalk_argos_program(NAME HEADER file.hpp CLASS template)
#
# makes NAME_kilobot and NAME_footbot, controllers with these labels (the first only where the
# Kilobot plugin is installed), and beside each an experiment with 36 robots, NAME_kilobot.argos.
# CLASS is a template over the robot (docs/argos.md). Sets:
#
#   SWARMTALK_ARGOS_FOUND, SWARMTALK_ARGOS_KILOBOT_FOUND; SWARMTALK_ARGOS_REASON, why not

include_guard(GLOBAL)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)  # else nothing is optimised
endif()
set(SWARMTALK_ARGOS_PREFIX "" CACHE PATH "Where ARGoS is installed, if not in /usr or /usr/local")
get_filename_component(SWARMTALK_ARGOS_ROOT ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
set(SWARMTALK_ARGOS_FOLDER ${CMAKE_CURRENT_LIST_DIR})

# ARGoS's own find_package() fails outright where its prefix is not the system's, so the four
# things that are needed are looked for by themselves.
set(prefixes ${SWARMTALK_ARGOS_PREFIX} $ENV{ARGOS_INSTALL_PREFIX})
find_path(SWARMTALK_ARGOS_INCLUDE argos3/core/config.h HINTS ${prefixes} PATH_SUFFIXES include)
find_program(SWARMTALK_ARGOS_PROGRAM argos3 HINTS ${prefixes} PATH_SUFFIXES bin)
foreach(part core_simulator plugin_simulator_genericrobot plugin_simulator_footbot
        plugin_simulator_kilobot)
  find_library(SWARMTALK_ARGOS_${part} argos3${part} HINTS ${prefixes}
    PATH_SUFFIXES lib/argos3 argos3)
endforeach()
unset(prefixes)

set(SWARMTALK_ARGOS_FOUND FALSE)
set(SWARMTALK_ARGOS_KILOBOT_FOUND FALSE)
set(SWARMTALK_ARGOS_REASON "")
if(NOT SWARMTALK_ARGOS_INCLUDE OR NOT SWARMTALK_ARGOS_core_simulator)
  string(CONCAT SWARMTALK_ARGOS_REASON "ARGoS 3 is not installed in /usr or /usr/local: install it "
    "as its own instructions say, or name its prefix with -DSWARMTALK_ARGOS_PREFIX=DIR")
elseif(NOT SWARMTALK_ARGOS_PROGRAM OR NOT SWARMTALK_ARGOS_plugin_simulator_footbot)
  string(CONCAT SWARMTALK_ARGOS_REASON "ARGoS 3 in ${SWARMTALK_ARGOS_INCLUDE} has no program argos3 "
    "or no foot-bot: it was built for a robot, not for the simulator")
else()
  set(SWARMTALK_ARGOS_FOUND TRUE)
  get_filename_component(SWARMTALK_ARGOS_LIBRARIES ${SWARMTALK_ARGOS_core_simulator} DIRECTORY)
  if(SWARMTALK_ARGOS_plugin_simulator_kilobot AND EXISTS
     ${SWARMTALK_ARGOS_INCLUDE}/argos3/plugins/robots/kilobot/control_interface/kilolib.h)
    set(SWARMTALK_ARGOS_KILOBOT_FOUND TRUE)
  endif()
endif()

# The library that all modules share: controllers and loop functions.
function(swarmtalk_argos_library)
  if(TARGET swarmtalk_argos)
    return()
  endif()
  set(root ${SWARMTALK_ARGOS_ROOT})
  set(sources controller.cpp experiment_file.cpp footbot_controller.cpp settings.cpp swarm_log.cpp)
  set(libraries ${SWARMTALK_ARGOS_core_simulator} ${SWARMTALK_ARGOS_plugin_simulator_genericrobot})
  if(SWARMTALK_ARGOS_KILOBOT_FOUND)
    list(APPEND sources kilobot_controller.cpp)
    list(APPEND libraries ${SWARMTALK_ARGOS_plugin_simulator_kilobot})
  endif()
  list(TRANSFORM sources PREPEND ${SWARMTALK_ARGOS_FOLDER}/)
  add_library(swarmtalk_argos SHARED ${sources})
  # kilolib's header defines macros called main, RED, GREEN and BLUE.
  set_source_files_properties(${SWARMTALK_ARGOS_FOLDER}/kilobot_controller.cpp PROPERTIES
    SWARMTALK_NOT_JOINED ON)
  target_compile_features(swarmtalk_argos PUBLIC cxx_std_20)
  target_include_directories(swarmtalk_argos PUBLIC ${root} ${root}/core/include)
  target_include_directories(swarmtalk_argos SYSTEM PUBLIC ${SWARMTALK_ARGOS_INCLUDE})
  file(STRINGS ${SWARMTALK_ARGOS_INCLUDE}/argos3/core/config.h lua REGEX "define ARGOS_WITH_LUA")
  if(lua)
    find_package(Lua REQUIRED)
    target_include_directories(swarmtalk_argos SYSTEM PUBLIC ${LUA_INCLUDE_DIR})
  endif()
  target_link_libraries(swarmtalk_argos PUBLIC ${libraries})
  # Same seed, same bytes, whatever the compiler: it must not join a product and a sum into one.
  target_compile_options(swarmtalk_argos PUBLIC -ffp-contract=off)
  # ARGoS opens libraries by their path, without their number.
  set_target_properties(swarmtalk_argos PROPERTIES LIBRARY_OUTPUT_DIRECTORY
    ${CMAKE_BINARY_DIR}/argos)
  if(COMMAND swarmtalk_warnings)
    swarmtalk_warnings(swarmtalk_argos)
  endif()
endfunction()

# Six rows of six; the first robot has role 1, which is hop count's seed.
function(swarmtalk_argos_places out robot spacing_mm attributes)
  set(places "")
  foreach(i RANGE 35)
    math(EXPR x "(${i} % 6) * ${spacing_mm}")
    math(EXPR y "(${i} / 6) * ${spacing_mm}")
    set(role 0)
    if(i EQUAL 0)
      set(role 1)
    endif()
    string(APPEND places "    <${robot} id=\"robot${i}\" ${attributes}>\n"
      "      <body position=\"${x}e-3,${y}e-3,0\" orientation=\"0,0,0\" />\n"
      "      <controller config=\"program\"><params index=\"${i}\" role=\"${role}\" "
      "power_on_spread_us=\"250000\" /></controller>\n"
      "    </${robot}>\n")
  endforeach()
  set(${out} ${places} PARENT_SCOPE)
endfunction()

function(swarmtalk_argos_module name robot header class)
  set(label ${name}_${robot})
  set(capital Kilobot)
  if(robot STREQUAL footbot)
    set(capital Footbot)
  endif()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/argos/${label}.cpp)
  configure_file(${SWARMTALK_ARGOS_FOLDER}/module.cpp.in ${source} @ONLY)
  add_library(${label} MODULE ${source})
  target_link_libraries(${label} PRIVATE swarmtalk_argos)
  set_target_properties(${label} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/argos)
  if(COMMAND swarmtalk_warnings)
    swarmtalk_warnings(${label})
  endif()
  # The experiment: what the template leaves open, for a look at a program without the suite.
  set(module ${CMAKE_BINARY_DIR}/argos/lib${label}.so)
  set(loop_functions ${CMAKE_BINARY_DIR}/argos/libswarmtalk_argos.so)
  set(seed 1)
  set(length 120)
  set(threads 0)
  set(loss 0)
  set(distance_noise 0)
  set(log_params "")
  set(window "")
  if(robot STREQUAL kilobot)
    set(arena "2,2,1")
    swarmtalk_argos_places(robots kilobot 50 "communication_range=\"0.075\"")
  else()
    set(arena "6,6,2")
    set(grid "6,6,1")
    swarmtalk_argos_places(robots foot-bot 300 "rab_range=\"0.86\" rab_data_size=\"10\"")
  endif()
  configure_file(${SWARMTALK_ARGOS_FOLDER}/experiments/${robot}.argos.in
    ${CMAKE_BINARY_DIR}/argos/${label}.argos @ONLY)
endfunction()

function(swarmtalk_argos_program name)
  cmake_parse_arguments(arg "" "HEADER;CLASS" "" ${ARGN})
  if(NOT SWARMTALK_ARGOS_FOUND)
    message(FATAL_ERROR "${SWARMTALK_ARGOS_REASON}")
  endif()
  if(NOT arg_HEADER OR NOT arg_CLASS)
    message(FATAL_ERROR "swarmtalk_argos_program(NAME HEADER file.hpp CLASS template)")
  endif()
  get_filename_component(header ${arg_HEADER} ABSOLUTE)
  swarmtalk_argos_library()
  if(SWARMTALK_ARGOS_KILOBOT_FOUND)
    swarmtalk_argos_module(${name} kilobot ${header} ${arg_CLASS})
  endif()
  swarmtalk_argos_module(${name} footbot ${header} ${arg_CLASS})
endfunction()
