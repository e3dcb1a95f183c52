#pragma once

#include <span>
#include <string>
#include <string_view>

namespace hapticd::console {

/// A file of client/console/page, compiled into the program.
struct PageFile {
  std::string_view name;  ///< "console.css"
  std::string_view text;
};
std::span<const PageFile> page_files();

/// File behind a path; nullptr if there is none. "/" is console.html, "/visual" visual.html, and every other
/// path the name of a file.
const PageFile* page_file_at(std::string_view path);
/// The file's ETag: a text in quotes that changes with the file.
std::string tag_of(const PageFile& file);
/// A page that says why there is nothing else to see, e.g. as the browser is not signed in.
std::string page_of_refusal(const std::string& why);
/// Content type by the ending of the name.
std::string_view content_type_of(std::string_view name);

}  // namespace hapticd::console
