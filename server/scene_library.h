#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::server {

/// The scenes the daemon knows by name: those built in, and the *.toml files of one folder, read anew at each
/// call so that a scene may be edited while the daemon runs. A file named like a built-in scene takes its
/// place.
class SceneLibrary {
 public:
  struct Entry {
    std::string name;
    std::string description;  ///< what is wrong with it, where it cannot be read
  };

  /// An empty folder name: built-in scenes only.
  explicit SceneLibrary(std::string folder = {}) : folder_(std::move(folder)) {}

  /// By name.
  std::vector<Entry> list() const;
  bool contains(const std::string& name) const;
  /// Unknown names are an error with a suggestion.
  hal::Result<rt::SceneSpec> find(const std::string& name) const;
  /// An error when there is a folder, but it cannot be read.
  std::optional<hal::Error> check_folder() const;

 private:
  std::vector<std::string> names() const;
  std::vector<std::string> folder_names() const;

  std::string folder_;
};

}  // namespace hapticd::server
