#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "rt/scene/scene_spec.h"
#include "server/text/text_library.h"

namespace hapticd::server {

/// The scenes that the daemon knows by name; see TextLibrary.
class SceneLibrary {
 public:
  struct Entry {
    std::string name;
    std::string description;  ///< what is wrong with it, if it cannot be read
  };

  /// Makes a library. An empty folder name: built-in scenes only.
  explicit SceneLibrary(std::string folder = {}) : texts_("scene", builtin_scenes(), std::move(folder)) {}

  /// Lists the scenes by name.
  std::vector<Entry> list() const;
  bool contains(const std::string& name) const { return texts_.contains(name); }
  /// Finds a scene; unknown names are an error with a suggestion.
  hal::Result<rt::SceneSpec> find(const std::string& name) const;
  /// Checks the folder: an error if there is one, but it cannot be read.
  std::optional<hal::Error> check_folder() const { return texts_.check_folder(); }

 private:
  TextLibrary texts_;
};

}  // namespace hapticd::server
