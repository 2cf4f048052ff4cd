# Files as C arrays inside the binary, so that it runs from anywhere.
#
#   impactd_embed(TARGET NAME ROOT FILE...)   adds to TARGET the table `embedded_NAME` of server/util/embedded.h: one
#                                             row per file, by its path from the folder ROOT, in the order given.
#
# The same file is the script that writes one such table while building (cmake -P).

if(NOT CMAKE_SCRIPT_MODE_FILE)
    set(IMPACTD_EMBED_SCRIPT ${CMAKE_CURRENT_LIST_FILE})

    function(impactd_embed target name root)
        set(source ${PROJECT_BINARY_DIR}/embedded/${name}.c)
        set(list ${PROJECT_BINARY_DIR}/embedded/${name}.txt)
        # The list is a file: a rule's command line has a limit, and a file taken away must rewrite the table.
        list(JOIN ARGN "\n" lines)
        file(CONFIGURE OUTPUT ${list} CONTENT "${lines}\n" @ONLY)
        add_custom_command(OUTPUT ${source}
            COMMAND ${CMAKE_COMMAND} -DNAME=${name} -DLIST=${list} -DROOT=${root} -DSOURCE=${source}
                -P ${IMPACTD_EMBED_SCRIPT}
            DEPENDS ${ARGN} ${list} ${IMPACTD_EMBED_SCRIPT}
            COMMENT "Embedding ${name}"
            VERBATIM)
        target_sources(${target} PRIVATE ${source})
    endfunction()
    return()
endif()

file(STRINGS ${LIST} files)
set(arrays "")
set(rows "")
set(index 0)
foreach(path ${files})
    file(READ ${path} hex HEX)
    file(SIZE ${path} size)
    file(SHA256 ${path} digest)
    string(SUBSTRING ${digest} 0 32 digest)
    file(RELATIVE_PATH name ${ROOT} ${path})
    string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
    # 0x..,: 16 bytes a line, and a NUL behind the last one so that a text can be used as it stands.
    string(REGEX REPLACE "(................................................................................)" "\\1\n"
        bytes "${bytes}")
    string(APPEND arrays "static const unsigned char file_${index}[] = {\n${bytes}0x00};\n")
    string(APPEND rows "    {\"${name}\", (const char *)file_${index}, ${size}, \"${digest}\"},\n")
    math(EXPR index "${index} + 1")
endforeach()
file(WRITE ${SOURCE}
    "#include \"server/util/embedded.h\"\n\n${arrays}\nconst EmbeddedFile embedded_${NAME}[] = {\n${rows}    {0},\n};\n")
