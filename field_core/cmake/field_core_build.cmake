# What all packages of the suite build alike: C++17, Release unless told otherwise, warnings, and one
# function each for a library, a program, scripts and tests, with catkin or without.

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Debug, Release, RelWithDebInfo" FORCE)
endif()
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)  # for tools/check.sh
set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
# Shared, as catkin builds: a library then brings what it links privately (CHOLMOD) to its users.
option(BUILD_SHARED_LIBS "Build shared libraries" ON)
# ROS's CMake scripts (rosbag finds pluginlib, that finds ament) run Python modules that Debian installs
# for its own interpreter; CMake would prefer a pyenv that comes first on PATH.
if(NOT DEFINED Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python of the ROS packages")
endif()
enable_testing()  # here, because inside a function it would only count there
set(FIELD_WARNINGS -Wall -Wextra -Wno-psabi)

# Where things are installed: catkin's places, or plain CMake's.
macro(field_install_places)
  if(CATKIN_PACKAGE_BIN_DESTINATION)
    set(_bin ${CATKIN_PACKAGE_BIN_DESTINATION})
    set(_lib ${CATKIN_PACKAGE_LIB_DESTINATION})
    set(_include ${CATKIN_GLOBAL_INCLUDE_DESTINATION})
  else()
    include(GNUInstallDirs)
    set(_bin ${CMAKE_INSTALL_LIBDIR}/${PROJECT_NAME})
    set(_lib ${CMAKE_INSTALL_LIBDIR})
    set(_include ${CMAKE_INSTALL_INCLUDEDIR})
  endif()
endmacro()

# field_library(name sources...): the package's library with its public headers. Without catkin it also
# writes a <name>Config.cmake that gives the same variables as catkin's.
macro(field_library name)
  field_install_places()
  # Before the workspace's merged include folder, where an older installation of this package may be.
  include_directories(BEFORE ${CMAKE_CURRENT_SOURCE_DIR}/include)
  add_library(${name} ${ARGN})
  target_compile_options(${name} PRIVATE ${FIELD_WARNINGS})
  # Finds the suite's other libraries beside it, wherever they are installed.
  set_target_properties(${name} PROPERTIES INSTALL_RPATH "$ORIGIN")
  target_include_directories(${name} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
  install(TARGETS ${name} ARCHIVE DESTINATION ${_lib} LIBRARY DESTINATION ${_lib} RUNTIME DESTINATION bin)
  install(DIRECTORY include/${PROJECT_NAME} DESTINATION ${_include})
  if(NOT catkin_FOUND)
    set(_config ${CMAKE_CURRENT_BINARY_DIR}/${PROJECT_NAME}Config.cmake)
    file(WRITE ${_config} "get_filename_component(_root \"\${CMAKE_CURRENT_LIST_DIR}/../../..\" ABSOLUTE)
set(${PROJECT_NAME}_INCLUDE_DIRS \"\${_root}/${_include}\")
find_library(_${PROJECT_NAME}_library ${name} PATHS \"\${_root}/${_lib}\" NO_DEFAULT_PATH REQUIRED)
set(${PROJECT_NAME}_LIBRARIES \"\${_${PROJECT_NAME}_library}\")
include(\"\${CMAKE_CURRENT_LIST_DIR}/field_core_build.cmake\" OPTIONAL)
")
    install(FILES ${_config} DESTINATION share/${PROJECT_NAME}/cmake)
    if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/cmake/field_core_build.cmake)
      install(FILES cmake/field_core_build.cmake DESTINATION share/${PROJECT_NAME}/cmake)
    endif()
  endif()
endmacro()

# field_program(name sources...): run as `rosrun <package> <name>`.
macro(field_program name)
  field_install_places()
  add_executable(${name} ${ARGN})
  target_compile_options(${name} PRIVATE ${FIELD_WARNINGS})
  # Finds the suite's libraries, one folder up, even when setup.bash was not sourced.
  set_target_properties(${name} PROPERTIES INSTALL_RPATH "$ORIGIN/..")
  install(TARGETS ${name} RUNTIME DESTINATION ${_bin})
endmacro()

# field_install_scripts(files...): run by Debian's own python3, whatever python3 comes first on PATH.
macro(field_install_scripts)
  field_install_places()
  install(PROGRAMS ${ARGN} DESTINATION ${_bin})
endmacro()

# field_tests(name LIBRARIES libs... FILES files...): one gtest program per file.
function(field_tests name)
  cmake_parse_arguments(arg "" "" "LIBRARIES;FILES" ${ARGN})
  if(catkin_FOUND AND NOT CATKIN_ENABLE_TESTING)
    return()
  endif()
  if(NOT catkin_FOUND)
    find_package(GTest QUIET)
    if(NOT GTest_FOUND)
      message(STATUS "${PROJECT_NAME}: GoogleTest not found, tests are not built")
      return()
    endif()
  endif()
  foreach(file ${arg_FILES})
    get_filename_component(base ${file} NAME_WE)
    set(target ${name}_${base})
    if(catkin_FOUND)
      catkin_add_gtest(${target} ${file} WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
    else()
      add_executable(${target} ${file})
      target_link_libraries(${target} GTest::gtest)
      add_test(NAME ${target} COMMAND ${target} WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
    endif()
    # Tests are compiled far more often than they run: little optimization halves the build.
    target_compile_options(${target} PRIVATE ${FIELD_WARNINGS} -O1)
    target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/test)
    target_link_libraries(${target} ${arg_LIBRARIES})
    if(TARGET gtest_main)
      target_link_libraries(${target} gtest_main)
    elseif(TARGET GTest::gtest_main)
      target_link_libraries(${target} GTest::gtest_main)
    endif()
  endforeach()
endfunction()
