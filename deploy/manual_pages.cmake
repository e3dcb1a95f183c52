# The manual pages of the programs, made of what each prints with --help. Without help2man there are none.
find_program(HAPTICD_HELP2MAN help2man)
if(NOT HAPTICD_HELP2MAN)
  message(STATUS "No manual pages: help2man is missing (bash deploy/install_packages.sh build)")
  return()
endif()

set(manual_pages "")
function(hapticd_manual_page target what)
  if(NOT TARGET ${target})
    return()
  endif()
  string(REPLACE _ - program ${target})
  set(page ${PROJECT_BINARY_DIR}/manual/${program}.1)
  add_custom_command(OUTPUT ${page}
    COMMAND ${HAPTICD_HELP2MAN} --no-info --no-discard-stderr --section=1 --name=${what}
            "--version-string=${program} ${PROJECT_VERSION}" --output=${page} $<TARGET_FILE:${target}>
    DEPENDS ${target} VERBATIM)
  install(FILES ${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
  set(manual_pages ${manual_pages} ${page} PARENT_SCOPE)
endfunction()

file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/manual)
hapticd_manual_page(hapticd "service that changes how stiff a real object feels")
hapticd_manual_page(hapticctl "talks to the haptic service hapticd")
hapticd_manual_page(hapticd_export "recordings of hapticd as HDF5 or CSV")
hapticd_manual_page(hapticd_igtl "poses of hapticd for OpenIGTLink programs")
hapticd_manual_page(hapticd_console "page of the haptic service hapticd")
add_custom_target(hapticd_manual_pages ALL DEPENDS ${manual_pages})
