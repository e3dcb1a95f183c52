#include "server/model/store/model_store_schema.h"

#include <SQLiteCpp/SQLiteCpp.h>

#include <array>
#include <cstring>
#include <fstream>
#include <string_view>

namespace hapticd::server::store_schema {

namespace {

/// The steps from each version to the next. A released step never changes; new ones are appended.
constexpr const char* kSteps[kVersion] = {
    // 0 → 1: models and their tags.
    R"sql(
CREATE TABLE models (
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  hash TEXT NOT NULL UNIQUE CHECK (length(hash) = 64),
  kind TEXT NOT NULL,
  subject TEXT NOT NULL,
  object TEXT NOT NULL,
  content TEXT NOT NULL,
  stored_at INTEGER NOT NULL
) STRICT;
CREATE INDEX models_by_subject ON models (kind, subject);
CREATE TRIGGER models_are_immutable BEFORE UPDATE ON models
BEGIN SELECT RAISE(ABORT, 'a stored model never changes'); END;
CREATE TABLE tags (
  kind TEXT NOT NULL,
  subject TEXT NOT NULL,
  tag TEXT NOT NULL,
  hash TEXT NOT NULL REFERENCES models (hash) ON DELETE CASCADE,
  PRIMARY KEY (kind, subject, tag)
) STRICT;
CREATE INDEX tags_by_hash ON tags (hash);
)sql",
    // 1 → 2: identifications that ended.
    R"sql(
CREATE TABLE identifications (
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL,
  kind TEXT NOT NULL,
  object TEXT NOT NULL,
  state TEXT NOT NULL,
  ended_at INTEGER NOT NULL,
  model TEXT NOT NULL,
  problem TEXT NOT NULL,
  progress BLOB NOT NULL
) STRICT;
)sql",
    // 2 → 3: the kind of rig of a model, and tags by it. Where a model comes from was reported by its data
    // only.
    R"sql(
DROP TRIGGER models_are_immutable;
ALTER TABLE models ADD COLUMN rig_kind TEXT NOT NULL DEFAULT '';
UPDATE models SET rig_kind = CASE WHEN content LIKE '% on rig ''sim:%' THEN 'simulated'
  WHEN content LIKE '% on rig ''%' THEN 'hardware' ELSE '' END;
CREATE TRIGGER models_are_immutable BEFORE UPDATE ON models
BEGIN SELECT RAISE(ABORT, 'a stored model never changes'); END;
ALTER TABLE tags RENAME TO tags_of_version_2;
CREATE TABLE tags (
  kind TEXT NOT NULL,
  subject TEXT NOT NULL,
  rig_kind TEXT NOT NULL,
  tag TEXT NOT NULL,
  hash TEXT NOT NULL REFERENCES models (hash) ON DELETE CASCADE,
  PRIMARY KEY (kind, subject, rig_kind, tag)
) STRICT;
INSERT INTO tags SELECT old.kind, old.subject, models.rig_kind, old.tag, old.hash
  FROM tags_of_version_2 AS old JOIN models ON models.hash = old.hash;
DROP TABLE tags_of_version_2;
CREATE INDEX tags_by_hash ON tags (hash);
)sql"};

hal::Error foreign(const std::string& path, const std::string& value) {
  return {"not a store of models", path, value, "a database made by hapticd",
          "name another file; this one was not touched"};
}

hal::Error newer(const std::string& path, int version) {
  return {"the store of models was written by a newer hapticd", path, "version " + std::to_string(version),
          "up to version " + std::to_string(kVersion),
          "start that hapticd, or name another file; this one was not touched"};
}

std::optional<hal::Error> judge(const std::string& path, std::int32_t application_id, int version) {
  if (application_id != kApplicationId) return foreign(path, "a database of another program");
  if (version > kVersion) return newer(path, version);
  return std::nullopt;
}

}  // namespace

// Checks the header, which is read without SQLite: that might write next to the file even when it only reads.
std::optional<hal::Error> check_header(const std::string& path) {
  constexpr std::size_t kVersionAt = 60;
  constexpr std::size_t kApplicationIdAt = 68;
  std::ifstream file(path, std::ios::binary);
  std::array<char, 100> header{};
  file.read(header.data(), header.size());
  const auto size = file.gcount();
  if (size == 0) return std::nullopt;
  constexpr std::string_view kMagic("SQLite format 3\0", 16);
  if (std::string_view(header.data(), kMagic.size()) != kMagic || size < 100) {
    return foreign(path, "no database");
  }
  const auto big_endian = [&header](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = value << 8U | static_cast<unsigned char>(header[i]);
    return static_cast<std::int32_t>(value);
  };
  // A store whose creation was interrupted has no id yet; migrate() examines its content.
  if (big_endian(kApplicationIdAt) == 0 && big_endian(kVersionAt) == 0) return std::nullopt;
  return judge(path, big_endian(kApplicationIdAt), big_endian(kVersionAt));
}

namespace {

int number(SQLite::Database& database, const char* query) {
  return database.execAndGet(query).getInt();
}

/// Checks inside a transaction, so that all values are of the same moment.
std::optional<hal::Error> check_now(SQLite::Database& database, const std::string& path) {
  const int application_id = number(database, "PRAGMA application_id");
  const int version = number(database, "PRAGMA user_version");
  const bool is_new =
      application_id == 0 && version == 0 && number(database, "SELECT count(*) FROM sqlite_schema") == 0;
  return is_new ? std::nullopt : judge(path, application_id, version);
}

}  // namespace

std::optional<hal::Error> check(SQLite::Database& database, const std::string& path) {
  const SQLite::Transaction moment(database, SQLite::TransactionBehavior::DEFERRED);
  return check_now(database, path);
}

std::optional<hal::Error> migrate(SQLite::Database& database, const std::string& path) {
  if (number(database, "PRAGMA user_version") == kVersion) return std::nullopt;
  SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
  if (auto error = check_now(database, path)) return error;
  for (int step = number(database, "PRAGMA user_version"); step < kVersion; ++step) {
    database.exec(kSteps[step]);
  }
  database.exec("PRAGMA application_id = " + std::to_string(kApplicationId));
  database.exec("PRAGMA user_version = " + std::to_string(kVersion));
  transaction.commit();
  return std::nullopt;
}

}  // namespace hapticd::server::store_schema
