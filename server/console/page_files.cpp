#include "server/console/page_files.h"

#include <algorithm>

namespace hapticd::server {

namespace {

struct Route {
  std::string_view path;
  std::string_view name;
};
constexpr Route kRoutes[] = {{"/", "console.html"}, {"/visual", "visual.html"}};

struct Type {
  std::string_view ending;
  std::string_view type;
};
constexpr Type kTypes[] = {{".html", "text/html; charset=utf-8"},
                           {".css", "text/css; charset=utf-8"},
                           {".js", "text/javascript; charset=utf-8"},
                           {".svg", "image/svg+xml"}};

}  // namespace

const PageFile* page_file_at(std::string_view path) {
  std::string_view name = path.substr(path.empty() ? 0 : 1);
  for (const Route& route : kRoutes) {
    if (route.path == path) name = route.name;
  }
  const auto files = page_files();
  const auto found =
      std::find_if(files.begin(), files.end(), [&](const PageFile& file) { return file.name == name; });
  return found == files.end() ? nullptr : &*found;
}

std::string_view content_type_of(std::string_view name) {
  for (const Type& type : kTypes) {
    if (name.ends_with(type.ending)) return type.type;
  }
  return "application/octet-stream";
}

}  // namespace hapticd::server
