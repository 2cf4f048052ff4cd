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
