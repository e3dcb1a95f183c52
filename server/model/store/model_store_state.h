#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "hal/lock/mutex.h"
#include "server/model/store/model_store.h"

namespace hapticd::server {

/// How often a file that another process keeps locked is tried again.
inline constexpr std::chrono::milliseconds kRetryEvery{5};

bool means_memory(const std::string& path);
bool is_busy(const SQLite::Exception& failure);
Refusal moved_away(const std::string& path);
/// SQLite's error as a refusal. `system_error`: errno of the call that failed.
Refusal refusal_of(const SQLite::Exception& failure, const std::string& path, int system_error);
inline Refusal invalid(hal::Error error) {
  return {RefusalKind::kInvalidArgument, std::move(error)};
}

/// The database and what its calls share.
struct ModelStore::State {
  State(const std::string& file, std::string kind_of_rig);

  /// Reads before it writes: a file that is refused is not changed. Throws SQLite::Exception.
  std::optional<hal::Error> set_up();

  /// Runs one call, alone in this process; an exception of SQLite becomes a refusal. While another process
  /// keeps the file locked it is tried again until `until`; other calls run in between.
  template <class Call>
  auto guarded(Until until, Call call) -> decltype(call()) {
    for (;;) {
      {
        const MutexLock lock(mutex);
        try {
          return call();
        } catch (const SQLite::Exception& failure) {
          // If the file was moved SQLite fails in many ways.
          if (was_moved()) return moved_away(path);
          if (!is_busy(failure) || std::chrono::steady_clock::now() >= until) {
            return refusal_of(failure, path, sqlite3_system_errno(database.getHandle()));
          }
        }
      }
      std::this_thread::sleep_for(kRetryEvery);
    }
  }

  /// True if the file that is open is no longer the one at its path: what is written into it is lost with
  /// this process, without a report.
  bool was_moved();
  /// Commits: every change ends with this.
  std::optional<Refusal> commit(SQLite::Transaction& transaction) {
    if (was_moved()) return moved_away(path);  // rolled back by its owner
    transaction.commit();
    return std::nullopt;
  }

  /// The whole hash with this beginning.
  Outcome<std::string> resolve(std::string_view hash);

  std::vector<std::string> tags_of(const std::string& hash);

  /// One row of hash, content, stored_at, rig_kind.
  Outcome<StoredModel> read_row(SQLite::Statement& query);

  /// Reads a model by its whole hash, which exists.
  Outcome<StoredModel> read(const std::string& hash);

  Outcome<StoredModel> find(std::string_view hash) {
    const auto whole = resolve(hash);
    if (!whole) return whole.refusal();
    return read(*whole);
  }

  Outcome<StoredModel> insert(const rt::IdentifiedModel& model, const std::string& canonical,
                              const std::string& hash, const std::string& identified_on);

  std::string path;           ///< empty = in memory
  std::string rig_kind;       ///< of the served rig; empty = any
  mutable SerialMutex mutex;  ///< held while the file is read or written
  SQLite::Database database;  ///< used within guarded() and set_up() only
};

}  // namespace hapticd::server
