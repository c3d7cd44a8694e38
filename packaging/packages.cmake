# Debian packages of an installation below /usr, made by CPack: see preset package.
#   libd2s1r0.3    the library; its name carries the version of the binary interface, as Debian wants it
#   libd2s1r-dev   headers, CMake package, pkg-config file
#   libd2s1r-mrpt0.3  the library for MRPT's large libraries, and the program that reads maps in MRPT's own formats
#   libd2s1r-mrpt-dev  its headers and pkg-config file
#   d2s1r-tools    rawlog-localize, module for MRPT's programs, man page, configurations, examples, documents
#   d2s1r-live     the node for ROS 2, with man page and systemd unit, if it is built
#   d2s1r-live-ros1  the same for ROS 1, if it is built
#   python3-d2s1r  Python module, if it is built
set(abi_version ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(method "One scan of a 2D laser and a known map give the poses where a robot may be,
with covariances and probabilities, without an initial pose and without moving.")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME d2s1r)
set(CPACK_PACKAGE_CONTACT "d2s1r authors <d2s1r@noreply.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL runtime development mrpt mrptdevelopment tools)
if(TARGET d2s1r-live)
  list(APPEND CPACK_COMPONENTS_ALL live)
endif()
if(TARGET d2s1r-live-ros1)
  list(APPEND CPACK_COMPONENTS_ALL ros1)
endif()
if(TARGET python-d2s1r)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/finish_packages.cmake)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/libs/d2s1r ${PROJECT_BINARY_DIR}/libs/mrpt)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
foreach(component development mrpt live ros1 python)
  string(TOUPPER ${component} name)
  set(CPACK_COMPONENT_${name}_DEPENDS runtime)
endforeach()
set(CPACK_COMPONENT_MRPTDEVELOPMENT_DEPENDS mrpt development)
set(CPACK_COMPONENT_TOOLS_DEPENDS runtime mrpt)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME libd2s1r${abi_version})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_RUNTIME_DESCRIPTION "${method}
.
This package contains the shared library.")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS libd2s1r-mrpt${abi_version})

set(CPACK_DEBIAN_MRPT_PACKAGE_NAME libd2s1r-mrpt${abi_version})
set(CPACK_DEBIAN_MRPT_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_MRPT_DESCRIPTION "${method}
.
This package contains the shared library that takes the maps and observations
of MRPT's large libraries, and the program that reads MRPT's map files.")

foreach(component RUNTIME MRPT)
  string(REGEX REPLACE "[0-9.]+$" "" library ${CPACK_DEBIAN_${component}_PACKAGE_NAME})
  configure_file(${CMAKE_CURRENT_LIST_DIR}/debian/shlibs.in ${PROJECT_BINARY_DIR}/packaging/${component}/shlibs @ONLY)
  set(CPACK_DEBIAN_${component}_PACKAGE_CONTROL_EXTRA
    ${CMAKE_CURRENT_LIST_DIR}/debian/triggers ${PROJECT_BINARY_DIR}/packaging/${component}/shlibs)
endforeach()

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libd2s1r-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libmrpt-poses-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS "d2s1r-tools")
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "${method}
.
This package contains the headers, the CMake package and the pkg-config file.")

set(CPACK_DEBIAN_MRPTDEVELOPMENT_PACKAGE_NAME libd2s1r-mrpt-dev)
set(CPACK_DEBIAN_MRPTDEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_MRPTDEVELOPMENT_PACKAGE_DEPENDS "libmrpt-maps-dev, libmrpt-obs-dev")
set(CPACK_DEBIAN_MRPTDEVELOPMENT_DESCRIPTION "${method}
.
This package contains the headers and the pkg-config file of the library for
MRPT's maps and observations.")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME d2s1r-tools)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SUGGESTS "mrpt-apps, mrpt-common, snakemake")
set(CPACK_DEBIAN_TOOLS_DESCRIPTION "${method}
.
This package contains rawlog-localize, which localizes the scans of a recorded
or live log, the module that MRPT's own programs load, and examples.")

set(CPACK_DEBIAN_LIVE_PACKAGE_NAME d2s1r-live)
set(CPACK_DEBIAN_LIVE_PACKAGE_SECTION science)
set(CPACK_DEBIAN_LIVE_DESCRIPTION "${method}
.
This package contains d2s1r-live, which tells the tracker of a running robot
with ROS 2 where the robot is, and notices when the tracker is lost.")

set(CPACK_DEBIAN_ROS1_PACKAGE_NAME d2s1r-live-ros1)
set(CPACK_DEBIAN_ROS1_PACKAGE_SECTION science)
set(CPACK_DEBIAN_ROS1_DESCRIPTION "${method}
.
This package contains d2s1r-live-ros1, which tells the tracker of a running
robot with ROS 1 where the robot is, and notices when the tracker is lost.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-d2s1r)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
if(D2S1R_PYTHON_VERSION MATCHES "^3\\.([0-9]+)")
  math(EXPR next_minor "${CMAKE_MATCH_1} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= 3.${CMAKE_MATCH_1}), python3 (<< 3.${next_minor}), python3-numpy")
endif()
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "${method}
.
This package contains the Python module d2s1r.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA
  ${CMAKE_CURRENT_LIST_DIR}/debian/postinst ${CMAKE_CURRENT_LIST_DIR}/debian/prerm)
include(CPack)
