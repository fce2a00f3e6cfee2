# Tests in Python, for ctest.

# swarmtalk_pytest(PREFIX KIND [ENVIRONMENT...] [NEEDS TARGETS...]): the pytest files of this folder, of a
# kind where they are not marked with another (tests/support/kinds.py). A file is one of ctest's tests
# for each kind that it has, "PREFIX.FILE.KIND": one process, so that its tests share what takes long to
# make. Each of them has 300 s (pytest.mark.timeout gives others), and is counted by pytest's own report
# (tools/test_results.py).
# NEEDS: what has to be built before they run, for tools/test -R and --changed; targets that are not
# there are left out.
function(swarmtalk_pytest prefix kind)
  cmake_parse_arguments(arg "" "" "NEEDS" ${ARGN})
  find_program(PYTHON3 python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  set(environment "SWARMTALK_BUILD=${PROJECT_BINARY_DIR}" "PYTHONDONTWRITEBYTECODE=1"
    "SWARMTALK_PREFIX=${prefix}" "SWARMTALK_KIND=${kind}" ${arg_UNPARSED_ARGUMENTS})
  file(GLOB scripts CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.py)
  set(plugin ${PROJECT_SOURCE_DIR}/tests/support/kinds.py)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${scripts} ${plugin})
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env ${environment}
      ${PYTHON3} ${plugin} collect ${prefix} ${kind} ${PROJECT_BINARY_DIR}/pytest/${prefix}.txt
    WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}
    OUTPUT_VARIABLE files ERROR_VARIABLE trouble RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "pytest cannot collect ${CMAKE_CURRENT_SOURCE_DIR}:\n${trouble}")
  endif()
  string(REGEX MATCHALL "[^\n]+" files "${files}")
  foreach(line IN LISTS files)
    separate_arguments(words UNIX_COMMAND "${line}")
    swarmtalk_add_pytest(${words})
  endforeach()
  swarmtalk_pytest_needs("" ${arg_NEEDS})
endfunction()

# For swarmtalk_pytest, whose variables it uses: the COUNT tests of a kind in a file.
macro(swarmtalk_add_pytest script each count)
  string(REGEX REPLACE "^(test_)?(.*)\\.py$" "${prefix}.\\2.${each}" name "${script}")
  set(limit_s 300)
  set(file_limit_s 1800)
  if("${each}" STREQUAL field)  # up to those of an hour of soak
    set(limit_s 7200)
    set(file_limit_s 36000)
  endif()
  set(report ${PROJECT_BINARY_DIR}/Testing/pytest/${name})
  add_test(NAME ${name} COMMAND ${PYTHON3} ${plugin} run -v -rs -p no:cacheprovider
    --timeout ${limit_s} --junitxml ${report}.xml ${script}
    WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
  # The largest files begin first.
  set_tests_properties(${name} PROPERTIES TIMEOUT ${file_limit_s} LABELS ${each} COST ${count}
    ENVIRONMENT "${environment};SWARMTALK_RUN=${each};SWARMTALK_BEGUN=${report}.begun")
endmacro()

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
