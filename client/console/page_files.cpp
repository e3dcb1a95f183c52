#include "client/console/page_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

namespace hapticd::console {

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

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else {
      result += c;
    }
  }
  return result;
}

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

std::string tag_of(const PageFile& file) {
  std::uint64_t sum = 14695981039346656037ULL;  // FNV-1a
  for (const char c : file.text) sum = (sum ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return fmt::format("\"{:016x}\"", sum);
}

std::string page_of_refusal(const std::string& why) {
  return "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width\"><title>hapticd</title><link rel=\"stylesheet\" "
         "href=\"/console.css\">"
         "<main class=\"refusal\"><h1>hapticd</h1><p>" +
         escaped(why) + "</p></main></html>";
}

}  // namespace hapticd::console
