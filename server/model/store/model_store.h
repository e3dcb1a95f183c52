#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/error.h"
#include "rt/model/identified_model.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// A model as it was stored. Everything but `stored_at_unix_s` and `tags` is under the hash and never
/// changes.
struct StoredModel {
  std::string hash;  ///< SHA-256 of the canonical text, see model_json.h
  rt::IdentifiedModel model;
  std::int64_t stored_at_unix_s = 0;
  std::vector<std::string> tags;  ///< sorted
  /// "simulated" or "hardware": the rig it was identified on; empty if that is not known, for recordings and
  /// imports.
  std::string rig_kind;

  /// First digits of the hash, as shown to people.
  std::string short_hash() const { return hash.substr(0, kShortHash); }
  static constexpr std::size_t kShortHash = 12;
};

/// Subject within which a tag is unique, next to the kind: the object (for friction with its tip,
/// "sponge/rod"), or the device, with its sensor if the model depends on that ("phantom_1_0/nano17_si_25").
std::string subject_of(const rt::IdentifiedModel& model);

/// The tag that scenes ask for when they name none.
inline constexpr const char* kCurrentTag = "current";

struct ModelFilter {  ///< empty = all
  std::string kind;
  std::string object;
  std::string tag;
};

/// An identification that is over. Texts are the caller's; the store only keeps them.
struct EndedIdentification {
  std::string id;
  std::string kind;
  std::string object;
  std::string state;
  std::int64_t ended_at_unix_s = 0;
  std::string model_hash;  ///< empty if there is none; it may have been deleted since
  std::string problem;
};

/// Identified models, kept permanently: immutable, under the hash of their content, with tags that can move.
/// An SQLite database; several processes may have it open at once. A call either succeeds, and its result
/// survives a crash of the process or the machine, or it changes nothing. Any thread. A call waits for the
/// disk, and until `until` for another process that keeps the file locked; other calls are served meanwhile.
///
/// Refusals: kNotFound if it does not exist, kInvalidArgument if it is not a hash, name or model,
/// kFailedPrecondition if it is in use or the file was moved or deleted, kUnavailable while another
/// process keeps the file locked, kResourceExhausted if the disk is full, kInternal if the disk or the file
/// fails.
class ModelStore {
 public:
  using Until = std::chrono::steady_clock::time_point;
  /// Does not wait for another process. For what scenes ask of the store while they are loaded.
  static constexpr Until kNow{};

  /// Makes the file and its folder if there are none, and brings an older file up to date. Refused, and not
  /// changed: a file that is not such a database, is of a newer version, or is damaged. An empty path or
  /// ":memory:": in memory, lost at the end.
  ///
  /// `rig_kind`: of the served rig, as StoredModel::rig_kind. Models identified on it are stored with this
  /// kind, and its "current" models are of this kind or of none: a model of a simulated rig is not used on
  /// hardware unless another tag asks for it. Empty: models of every kind are used.
  static hal::Result<std::unique_ptr<ModelStore>> open(const std::string& path,
                                                       const std::string& rig_kind = {});
  /// Checks whether open() would accept the file. Creates and changes nothing.
  static std::optional<hal::Error> check(const std::string& path);
  ~ModelStore();
  ModelStore(const ModelStore&) = delete;
  ModelStore& operator=(const ModelStore&) = delete;

  bool in_memory() const;
  /// Path of the file; empty when in memory.
  const std::string& path() const;
  /// True if a model may be the "current" one of the rig.
  bool serves(const StoredModel& stored) const;

  /// Stores a model. One that is stored already stays as it is, with its time and tags.
  Outcome<StoredModel> add(const rt::IdentifiedModel& model, Until until = kNow);
  /// Gets a model by any unambiguous beginning of its hash of at least 6 digits.
  Outcome<StoredModel> get(std::string_view hash, Until until = kNow) const;
  /// True if a model has this whole hash. True also while the file cannot be read.
  bool contains(const std::string& hash, Until until = kNow) const;
  /// Lists models, newest first. Those that cannot be read are logged and left out.
  Outcome<std::vector<StoredModel>> list(const ModelFilter& filter = {}, Until until = kNow) const;
  /// Model that has the tag; one of the rig's own kind is preferred to one of no kind.
  Outcome<StoredModel> tagged(const std::string& kind, const std::string& subject, const std::string& tag,
                              Until until = kNow) const;
  /// Tags of models of this subject, sorted, each once.
  Outcome<std::vector<std::string>> tags_of(const std::string& kind, const std::string& subject,
                                            Until until = kNow) const;

  /// Sets the tag, and removes it from the model of the same kind, subject and kind of rig that had it.
  Outcome<StoredModel> tag(std::string_view hash, const std::string& tag, Until until = kNow);
  /// kNotFound if it has no such tag.
  Outcome<StoredModel> untag(std::string_view hash, const std::string& tag, Until until = kNow);
  /// Deletes it with its tags, and returns the whole hash. `in_use` is asked under the store's lock.
  Outcome<std::string> erase(std::string_view hash,
                             const std::function<bool(const std::string& hash)>& in_use, Until until = kNow);

  Outcome<std::string> export_json(std::string_view hash, Until until = kNow) const;
  /// Refusals as of import_json() in model_json.h, kInvalidArgument.
  Outcome<StoredModel> import_json(std::string_view json, Until until = kNow);

  /// Stores one; of more than 1000 the oldest are deleted.
  Outcome<std::uint64_t> record_identification(const EndedIdentification& ended, Until until = kNow);
  /// Lists identifications, newest first.
  Outcome<std::vector<EndedIdentification>> list_identifications(std::size_t limit, Until until = kNow) const;

 private:
  struct State;
  explicit ModelStore(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::server
