# cmake --install build [--prefix X], with DESTDIR for packages: program, manual, completion, unit, schemas.
include(GNUInstallDirs)
add_executable(print_pages server/install/pages.c server/install/guide_parts.c)
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
    COMMAND print_guide ${PROJECT_SOURCE_DIR}/web/guide ${PAGES} ${GUIDE}
    COMMAND ${CMAKE_COMMAND} -E copy ${GUIDE_FILES} ${GUIDE}
    DEPENDS print_guide ${GUIDE_SOURCES} ${GUIDE_FILES} web/guide/guide.html web/guide/pages.txt ${PAGES}/impactd.1
    COMMENT "Rendering the guide"
    VERBATIM)
impactd_embed(impactd guide ${CMAKE_BINARY_DIR} ${GUIDE_PAGES} ${GUIDE_COPIES})

install(TARGETS impactd RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES ${PAGES}/impactd.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${PAGES}/impactd-scene.5 DESTINATION ${CMAKE_INSTALL_MANDIR}/man5)
install(FILES server/install/impactd.service.8 DESTINATION ${CMAKE_INSTALL_MANDIR}/man8)
install(FILES ${PAGES}/impactd.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME impactd)
file(GLOB INSTALLED_SCHEMAS CONFIGURE_DEPENDS schema/*.json)
file(GLOB INSTALLED_EXAMPLES CONFIGURE_DEPENDS schema/examples/*.json)
install(FILES ${INSTALLED_SCHEMAS} DESTINATION ${CMAKE_INSTALL_DATADIR}/impactd/schema)
install(FILES ${INSTALLED_EXAMPLES} DESTINATION ${CMAKE_INSTALL_DATADIR}/impactd/examples)
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
# The unit has the path of the program in this installation.
install(CODE "
    get_filename_component(prefix \"\${CMAKE_INSTALL_PREFIX}\" ABSOLUTE)
    set(IMPACTD_BINARY \"\${prefix}/${CMAKE_INSTALL_BINDIR}/impactd\")
    configure_file(\"${PROJECT_SOURCE_DIR}/server/install/impactd.service.in\" \"${PAGES}/impactd.service\" @ONLY)
    file(INSTALL DESTINATION \"\${CMAKE_INSTALL_PREFIX}/lib/systemd/system\" TYPE FILE FILES \"${PAGES}/impactd.service\")")
