#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "rt/model/models.h"
#include "server/text_library.h"

namespace hapticd::server {

/// The models of objects that the daemon knows by name; see TextLibrary.
class ModelLibrary {
 public:
  struct Entry {
    std::string name;
    std::optional<rt::ObjectModel> model;
    std::string problem;  ///< where there is no model: why
  };

  /// An empty folder name: built-in models only.
  explicit ModelLibrary(std::string folder = {}) : texts_("model", builtin_models(), std::move(folder)) {}

  /// By name.
  std::vector<Entry> list() const;
  std::vector<std::string> names() const { return texts_.names(); }
  bool contains(const std::string& name) const { return texts_.contains(name); }
  /// Unknown names are an error with a suggestion.
  hal::Result<rt::ObjectModel> find(const std::string& name) const;
  /// An error when there is a folder, but it cannot be read.
  std::optional<hal::Error> check_folder() const { return texts_.check_folder(); }

 private:
  TextLibrary texts_;
};

}  // namespace hapticd::server
