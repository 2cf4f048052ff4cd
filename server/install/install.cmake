# cmake --install build [--prefix X], with DESTDIR for packages: program, manual, completion, unit, schemas.
include(GNUInstallDirs)
add_executable(print_pages server/install/pages.c)
target_link_libraries(print_pages PRIVATE impactd_server)
set_target_properties(print_pages PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/install)
set(PAGES ${CMAKE_BINARY_DIR}/install)
add_custom_command(
    OUTPUT ${PAGES}/impactd.1 ${PAGES}/impactd-scene.5 ${PAGES}/impactd.bash
    COMMAND print_pages ${PAGES} DEPENDS print_pages VERBATIM)
add_custom_target(pages ALL DEPENDS ${PAGES}/impactd.1)

# The guide: pages of web/guide as HTML, with their pictures, style and script, embedded in the program.
file(GLOB GUIDE_SOURCES CONFIGURE_DEPENDS web/guide/*.md)
file(GLOB GUIDE_FILES CONFIGURE_DEPENDS web/guide/*.svg web/guide/*.png web/guide/*.css web/guide/*.js)
set(GUIDE ${CMAKE_BINARY_DIR}/guide)
set(GUIDE_PAGES ${GUIDE}/search.json)
foreach(source ${GUIDE_SOURCES})
    get_filename_component(name ${source} NAME_WE)
    list(APPEND GUIDE_PAGES ${GUIDE}/${name}.html)
endforeach()
set(GUIDE_COPIES ${GUIDE_FILES})
list(TRANSFORM GUIDE_COPIES REPLACE "^.*/" ${GUIDE}/)

add_executable(print_guide server/install/guide.c)
target_link_libraries(print_guide PRIVATE impactd_server PkgConfig::CMARK ${CMARK_EXTENSIONS})
set_target_properties(print_guide PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/install)
file(MAKE_DIRECTORY ${GUIDE})
add_custom_command(OUTPUT ${GUIDE_PAGES} ${GUIDE_COPIES}
    COMMAND sh -c "jq -r -L web/guide 'include \"parts\"; api' schema/openapi.json > '${PAGES}/api.md'"
    COMMAND sh -c "jq -r -L web/guide 'include \"parts\"; scene' schema/scene.schema.json > '${PAGES}/scene.md'"
    COMMAND print_guide ${PROJECT_SOURCE_DIR}/web/guide ${PAGES} ${GUIDE}
    COMMAND ${CMAKE_COMMAND} -E copy ${GUIDE_FILES} ${GUIDE}
    DEPENDS print_guide ${GUIDE_SOURCES} ${GUIDE_FILES} web/guide/guide.html web/guide/pages.txt web/guide/parts.jq
        schema/openapi.json schema/scene.schema.json ${PAGES}/impactd.1
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
    COMMENT "Rendering the guide"
    VERBATIM)
impactd_embed(impactd guide ${CMAKE_BINARY_DIR} ${GUIDE_PAGES} ${GUIDE_COPIES})

install(TARGETS impactd RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY ${PAGES}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 FILES_MATCHING PATTERN "*.1" PATTERN deb EXCLUDE)
install(FILES ${PAGES}/impactd-scene.5 DESTINATION ${CMAKE_INSTALL_MANDIR}/man5)
install(FILES server/install/impactd.service.8 DESTINATION ${CMAKE_INSTALL_MANDIR}/man8)
install(FILES ${PAGES}/impactd.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME impactd)
file(GLOB INSTALLED_SCHEMAS CONFIGURE_DEPENDS schema/*.json)
file(GLOB INSTALLED_EXAMPLES CONFIGURE_DEPENDS schema/examples/*.json)
install(FILES ${INSTALLED_SCHEMAS} DESTINATION ${CMAKE_INSTALL_DATADIR}/impactd/schema)
install(FILES ${INSTALLED_EXAMPLES} DESTINATION ${CMAKE_INSTALL_DATADIR}/impactd/examples)
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
file(GLOB INSTALLED_GUIDE CONFIGURE_DEPENDS web/guide/*.md web/guide/*.svg web/guide/*.png)
file(GLOB INSTALLED_CLIENTS CONFIGURE_DEPENDS web/client/*.py web/client/*.m)
install(FILES ${INSTALLED_GUIDE} DESTINATION ${CMAKE_INSTALL_DOCDIR}/guide)
install(FILES ${INSTALLED_CLIENTS} DESTINATION ${CMAKE_INSTALL_DATADIR}/impactd/client)
# The unit has the path of the program in this installation.
install(CODE "
    get_filename_component(prefix \"\${CMAKE_INSTALL_PREFIX}\" ABSOLUTE)
    set(IMPACTD_BINARY \"\${prefix}/${CMAKE_INSTALL_BINDIR}/impactd\")
    configure_file(\"${PROJECT_SOURCE_DIR}/server/install/impactd.service.in\" \"${PAGES}/impactd.service\" @ONLY)
    file(INSTALL DESTINATION \"\${CMAKE_INSTALL_PREFIX}/lib/systemd/system\" TYPE FILE FILES \"${PAGES}/impactd.service\")")

# cpack -G DEB, in the build folder: impactd_VERSION_ARCH.deb. Its unit has the user impactd instead of a dynamic one, so
# that commands can be run as that user. Options of `impactd serve` are lines of the configuration file.
file(WRITE ${PAGES}/deb/default "# Options of `impactd serve`, one to a line; see impactd.service(8). For example:
#IMPACTD_LISTEN=127.0.0.1:8080
#IMPACTD_WORKERS=2
")
file(WRITE ${PAGES}/deb/conffiles "/etc/default/impactd\n")
file(WRITE ${PAGES}/deb/overrides "# The project has no mail address: a distributor sets CPACK_PACKAGE_CONTACT.
impactd: bogus-mail-host *
impactd: bogus-mail-host-in-debian-changelog *
")
file(READ LICENSE licence)
string(REGEX REPLACE ".*\n\n(Permission)" "\\1" licence "${licence}")
string(REPLACE "\n" "\n " licence "${licence}")
string(REPLACE "\n \n" "\n .\n" licence "${licence}")
file(READ web/vendor/dejavu/LICENSE vera)
string(REGEX REPLACE ".*\n\n(Permission)" "\\1" vera "${vera}")
string(REPLACE "\n" "\n " vera "${vera}")
string(REPLACE "\n \n" "\n .\n" vera "${vera}")
file(WRITE ${PAGES}/deb/copyright "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: impactd
Comment: The program is linked with FFTW, which is under the GNU General Public
 License, version 2 or later, and contains htm, which is under the Apache License
 2.0. Together they may be passed on under the terms of version 3, in
 /usr/share/common-licenses/GPL-3. It contains dragonbox (Copyright 2020-2021
 Junekey Jeon, Boost Software License 1.0).

Files: *
Copyright: 2026 the impactd authors
License: Expat

Files: web/vendor/htm/*
Copyright: 2018 Google Inc., 2015-present Jason Miller (Preact, which is part of it)
License: Apache-2.0 and Expat

Files: web/vendor/inter/*
Copyright: 2016 The Inter Project Authors
License: OFL-1.1
 The whole text is in web/vendor/inter/LICENSE of the sources, and at
 https://openfontlicense.org.

Files: web/vendor/dejavu/*
Copyright: 2003 Bitstream, Inc.
License: bitstream-vera
 Bitstream Vera is a trademark of Bitstream, Inc. DejaVu changes are in public
 domain.
 .
 ${vera}

License: Apache-2.0 and Expat
 The Apache License 2.0 is in /usr/share/common-licenses/Apache-2.0; the
 licence of Preact is the Expat licence below.

License: Expat
 ${licence}")
# What Debian wants otherwise than `cmake --install` has it.
file(WRITE ${PAGES}/deb/prepare.cmake [[
    find_program(DPKG_SHLIBDEPS dpkg-shlibdeps)
    find_program(FILE_TYPES file)
    if(NOT DPKG_SHLIBDEPS OR NOT FILE_TYPES)
        message(FATAL_ERROR "the package is made with the Debian packages dpkg-dev and file: install them")
    endif()
    set(root ${CPACK_TEMPORARY_INSTALL_DIRECTORY})
    string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
    file(WRITE ${root}/usr/share/doc/impactd/changelog "impactd (${CPACK_PACKAGE_VERSION}) unstable; urgency=medium

  * Release ${CPACK_PACKAGE_VERSION}.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
    file(REMOVE ${root}/usr/share/doc/impactd/LICENSE)
    file(READ ${root}/usr/lib/systemd/system/impactd.service unit)
    string(REPLACE "DynamicUser=yes" "User=impactd" unit "${unit}")
    file(WRITE ${root}/usr/lib/systemd/system/impactd.service "${unit}")
    file(GLOB pages ${root}/usr/share/man/man*/*.[1-9] ${root}/usr/share/doc/impactd/changelog)
    execute_process(COMMAND gzip -9nf ${pages} COMMAND_ERROR_IS_FATAL ANY)
]])
foreach(script postinst prerm postrm)
    configure_file(server/install/maintainer.sh ${PAGES}/deb/${script} COPYONLY)
    list(APPEND CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PAGES}/deb/${script})
endforeach()
list(APPEND CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PAGES}/deb/conffiles)
install(FILES ${PAGES}/deb/default DESTINATION /etc/default RENAME impactd COMPONENT debian EXCLUDE_FROM_ALL)
install(FILES ${PAGES}/deb/overrides DESTINATION share/lintian/overrides RENAME impactd COMPONENT debian EXCLUDE_FROM_ALL)
install(FILES ${PAGES}/deb/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT debian EXCLUDE_FROM_ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the impactd authors <impactd@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "simulator of structures with impact dampers")
set(CPACK_PACKAGE_DESCRIPTION "An impact damper is a free mass that bounces between two stops inside a
vibrating structure and dissipates its energy. impactd computes the motion,
all impacts, spectra and the energy balance of a scene in JSON: as a server
with an HTTP interface and a dashboard, and as a command line.")
set(CPACK_INSTALL_CMAKE_PROJECTS "${CMAKE_BINARY_DIR};impactd;ALL;/;${CMAKE_BINARY_DIR};impactd;debian;/")
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS ${PAGES}/deb/prepare.cmake)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS adduser)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "curl, python3")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
