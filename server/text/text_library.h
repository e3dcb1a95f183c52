#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "server/text/builtin_texts.h"

namespace hapticd::server {

/// Names are file names too: 1 … 64 of a-z A-Z 0-9 _ -. `kind` is the word for it in errors, e.g.
/// "scene".
std::optional<hal::Error> check_name(std::string_view kind, std::string_view name, std::string_view where);

/// TOML texts by name: those built in, and the *.toml files of one folder, read again at each call so that
/// they may be edited while the daemon runs. A file named like a built-in text takes its place.
class TextLibrary {
 public:
  /// Makes a library. An empty folder name: built-in texts only.
  TextLibrary(std::string kind, std::span<const BuiltinText> builtin, std::string folder)
      : kind_(std::move(kind)), builtin_(builtin), folder_(std::move(folder)) {}

  struct Text {
    std::string toml;
    std::string source;  ///< its name in errors: a path, or "built-in scene 'tap_1d'"
  };

  /// Names, sorted, without duplicates.
  std::vector<std::string> names() const;
  bool contains(const std::string& name) const;
  /// Finds a text; unknown names are an error with a suggestion. A name is looked up; it is never used as a
  /// path.
  hal::Result<Text> find(const std::string& name) const;
  /// Checks the folder: an error if there is one, but it cannot be read.
  std::optional<hal::Error> check_folder() const;

 private:
  std::vector<std::string> folder_names() const;

  std::string kind_;
  std::span<const BuiltinText> builtin_;
  std::string folder_;
};

}  // namespace hapticd::server
