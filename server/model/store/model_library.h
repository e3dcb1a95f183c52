#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "hal/rig.h"
#include "rt/model/models.h"
#include "server/model/store/model_store.h"
#include "server/text/text_library.h"

namespace hapticd::server {

/// The name of a model in a scene: "NAME", or "NAME@TAG" for the stored models with another tag than
/// "current".
struct ModelName {
  std::string object;
  std::string tag;  ///< empty = not given

  /// Splits and checks both. `where` is the place that errors name.
  static hal::Result<ModelName> parse(std::string_view text, std::string_view where);
};

/// The model of an object put together for a scene, and where each part of it comes from.
struct FoundModel {
  /// Null = the model file.
  using Origin = std::shared_ptr<const StoredModel>;

  rt::ObjectModel model;
  Origin hunt_crossley;
  Origin creep;
  Origin rod_friction;
  Origin bearing_friction;

  /// Hashes of the stored models among them, each once.
  std::vector<std::string> stored() const;
};

/// Models of the rig itself that are tagged "current" for it. Null = none.
struct RigModels {
  using Model = std::shared_ptr<const StoredModel>;
  Model structure;
  Model tool;
  Model threshold;
  Model gains;
};

/// The models that scenes can ask for by name. Each part of an object's model comes from the stored model
/// tagged "current", else from the model file of its name (see TextLibrary). With a tag: from the stored
/// model that has it, else as without.
class ModelLibrary {
 public:
  struct Entry {
    std::string name;
    std::optional<rt::ObjectModel> model;
    std::vector<std::string> stored;  ///< hashes of the stored models it is made of
    std::string problem;              ///< if there is no model: why
  };

  /// Makes a library. An empty folder name: built-in models only. Without a store there are model files only.
  explicit ModelLibrary(std::string folder = {}, std::shared_ptr<ModelStore> store = nullptr)
      : texts_("model", builtin_models(), std::move(folder)), store_(std::move(store)) {}

  /// Lists the models, sorted by name; of the stored ones those that are tagged "current".
  std::vector<Entry> list() const;
  std::vector<std::string> names() const;
  /// True if there is a file or a tagged model of the object, even if it cannot be used or lacks the tag.
  bool contains(const std::string& name) const;
  /// Finds a model; unknown names and tags are an error with a suggestion.
  hal::Result<rt::ObjectModel> find(const std::string& name) const;
  /// Finds a model with the origins. kNotFound if there is none, kInvalidArgument if it cannot be used.
  Outcome<FoundModel> find_parts(const std::string& name) const;
  /// Finds the stored model of an inclusion, NAME or NAME@TAG. kNotFound with a suggestion if there is none.
  Outcome<FoundModel::Origin> find_inclusion(const std::string& name) const;
  /// True if the object's friction is known for the other tip only.
  bool has_friction_of_bearing(const std::string& name) const;
  /// The models for this device and sensor.
  RigModels of_rig(const hal::RigInfo& rig) const;
  /// Checks the folder: an error if there is one, but it cannot be read.
  std::optional<hal::Error> check_folder() const { return texts_.check_folder(); }

  /// Store of the models; null if there is none.
  const std::shared_ptr<ModelStore>& store() const { return store_; }

 private:
  /// The stored model with the first of the tags that one has.
  FoundModel::Origin stored(const std::string& kind, const std::string& subject,
                            const std::vector<std::string>& tags) const;
  /// Tags of all models of an object that scenes can use.
  std::vector<std::string> tags_of(const std::string& object) const;
  hal::Error unknown(const std::string& object) const;
  /// Kind of rig of the object's stored models that are of another kind than this rig; empty if there are
  /// none.
  std::string other_rig_kind(const std::string& object) const;
  hal::Error unknown_tag(const ModelName& name) const;
  /// Objects that have stored models tagged "current".
  std::vector<std::string> stored_objects() const;

  TextLibrary texts_;
  std::shared_ptr<ModelStore> store_;
};

}  // namespace hapticd::server
