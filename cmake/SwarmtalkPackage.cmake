# The Debian package of daemon, client library and command line: `cpack -G DEB` in a build folder.
# What it holds is what `cmake --install` lays down; its dependencies are found by dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME swarmtalk)
set(CPACK_PACKAGE_VENDOR "SwarmTalk")
set(CPACK_PACKAGE_CONTACT "swarmtalkd authors <swarmtalk@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION net)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "systemd | systemd-standalone-sysusers, python3")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "g++, libprotobuf-dev, prometheus-node-exporter")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "publish/subscribe over broadcast frames for swarm robots")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
  "SwarmTalk gives robot programs channels to publish and subscribe on, over a
radio that only broadcasts: no broker, no addresses, any message length, some
hops, and with each message how far away its transmitter was.
.
This package has swarmtalkd, which owns the radio, swarmtalk-cli, and the C++
library that robot programs link.")
set(control ${PROJECT_SOURCE_DIR}/packaging/debian)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
  "${control}/conffiles;${control}/postinst;${control}/prerm;${control}/postrm;${control}/triggers;${control}/shlibs")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# What Debian wants to find in a package, beside what the program needs.
find_program(SWARMTALK_GZIP gzip REQUIRED)
set(changelog ${PROJECT_BINARY_DIR}/changelog.Debian.gz)
add_custom_command(OUTPUT ${changelog}
  COMMAND ${SWARMTALK_GZIP} -9nc ${control}/changelog > ${changelog}
  DEPENDS ${control}/changelog)
add_custom_target(debian_changelog ALL DEPENDS ${changelog})
install(FILES ${changelog} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/swarmtalk)
install(FILES ${control}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/swarmtalk)

include(CPack)
