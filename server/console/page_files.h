#pragma once

#include <span>
#include <string_view>

namespace hapticd::server {

/// A file of server/console/page, compiled into the daemon.
struct PageFile {
  std::string_view name;  ///< "console.css"
  std::string_view text;
};
std::span<const PageFile> page_files();

/// The file behind a path; nullptr where there is none. "/" is console.html, "/visual" visual.html, and every
/// other path the name of a file.
const PageFile* page_file_at(std::string_view path);
/// By the ending of the name.
std::string_view content_type_of(std::string_view name);

}  // namespace hapticd::server
