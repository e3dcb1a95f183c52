# Writes a source file that holds every scene file as a raw string: cmake -D SCENES=a;b -D OUTPUT=file -P this
set(entries "")
foreach(file IN LISTS SCENES)
  get_filename_component(name ${file} NAME_WE)
  file(READ ${file} text)
  string(APPEND entries "    {\"${name}\", R\"scene(${text})scene\"},\n")
endforeach()
file(WRITE ${OUTPUT} "// Generated from server/scenes.
#include \"server/builtin_scenes.h\"

namespace hapticd::server {

namespace {
constexpr BuiltinScene kScenes[] = {
${entries}};
}  // namespace

std::span<const BuiltinScene> builtin_scenes() {
  return kScenes;
}

}  // namespace hapticd::server
")
