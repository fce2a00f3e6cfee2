# Builds images for Kilobots inside the main build: avr-g++ by custom commands, because a CMake
# project has one compiler and this one's is the host's. Needs Debian's gcc-avr and avr-libc.
#
#   kilobot_image(NAME SOURCES file... [DEFINES name...] [ADDRESS 0x7000])
#
# makes <build>/kilobot/NAME.elf and NAME.hex, part of target kilobot_images. Sources are given from
# the repository's root; an object is shared by all images that compile it alike.

find_program(KILOBOT_CXX avr-g++)
find_program(KILOBOT_OBJCOPY avr-objcopy)
find_program(KILOBOT_SIZE avr-size)

set(KILOBOT_IMAGE_DIR ${CMAKE_BINARY_DIR}/kilobot)

# The passes switched off make no difference to speed here and cost flash.
set(KILOBOT_FLAGS
  -mmcu=atmega328p -DF_CPU=8000000UL -std=c++14 -Os -flto -ffunction-sections -fdata-sections
  -mcall-prologues -mstrict-X -fno-move-loop-invariants -fno-guess-branch-probability
  -fno-forward-propagate -fno-tree-copy-prop -fno-tree-scev-cprop -fno-tree-ccp
  -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-use-cxa-atexit
  -funsigned-char -fshort-enums -Wall -Wextra -Wshadow
  -I${PROJECT_SOURCE_DIR} -I${PROJECT_SOURCE_DIR}/core/include)
set(KILOBOT_LINK_FLAGS -Wl,--gc-sections -mrelax)

# Adds the rule that compiles `source` with `defines`; its object goes to `out`.
function(kilobot_object out source defines)
  string(MD5 key "${source};${defines}")
  string(SUBSTRING ${key} 0 8 key)
  get_filename_component(stem ${source} NAME_WE)
  set(object ${KILOBOT_IMAGE_DIR}/objects/${stem}-${key}.o)
  set(${out} ${object} PARENT_SCOPE)
  get_property(known GLOBAL PROPERTY KILOBOT_OBJECTS)
  if(object IN_LIST known)
    return()
  endif()
  set_property(GLOBAL APPEND PROPERTY KILOBOT_OBJECTS ${object})
  cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE path)
  set(define_flags ${defines})
  list(TRANSFORM define_flags PREPEND -D)
  add_custom_command(OUTPUT ${object}
    COMMAND ${KILOBOT_CXX} ${KILOBOT_FLAGS} ${define_flags} ${KILOBOT_EXTRA_FLAGS}
            -MMD -MF ${object}.d -MT ${object} -c ${path} -o ${object}
    DEPENDS ${path} DEPFILE ${object}.d
    COMMENT "Kilobot object ${stem}.o" VERBATIM COMMAND_EXPAND_LISTS)
endfunction()

function(kilobot_image name)
  cmake_parse_arguments(arg "" "ADDRESS" "SOURCES;DEFINES" ${ARGN})
  set(objects "")
  foreach(source IN LISTS arg_SOURCES)
    kilobot_object(object ${source} "${arg_DEFINES}")
    list(APPEND objects ${object})
  endforeach()
  set(address_flag "")
  if(arg_ADDRESS)
    set(address_flag -Wl,--section-start=.text=${arg_ADDRESS})
  endif()
  set(elf ${KILOBOT_IMAGE_DIR}/${name}.elf)
  set(hex ${KILOBOT_IMAGE_DIR}/${name}.hex)
  add_custom_command(OUTPUT ${elf} ${hex}
    COMMAND ${KILOBOT_CXX} ${KILOBOT_FLAGS} ${KILOBOT_LINK_FLAGS} ${address_flag}
            ${objects} ${KILOBOT_EXTRA_OBJECTS} -o ${elf}
    COMMAND ${KILOBOT_OBJCOPY} -O ihex -R .eeprom -R .fuse -R .lock -R .signature
            ${elf} ${hex}
    DEPENDS ${objects} COMMENT "Kilobot image ${name}" VERBATIM COMMAND_EXPAND_LISTS)
  set_property(GLOBAL APPEND PROPERTY KILOBOT_IMAGES ${elf} ${hex})
endfunction()

# Target kilobot_images: everything that kilobot_image() named, part of the default build.
function(kilobot_images_target)
  get_property(images GLOBAL PROPERTY KILOBOT_IMAGES)
  add_custom_target(kilobot_images ALL DEPENDS ${images})
endfunction()
