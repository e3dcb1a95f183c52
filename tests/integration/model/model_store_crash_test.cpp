#include <SQLiteCpp/SQLiteCpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "server/model/canonical_text.h"
#include "server/model/model_json.h"
#include "server/model/store/model_store.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

/// What a writer reported before it was killed.
struct Acknowledged {
  std::set<std::string> models;
  std::set<std::string> identifications;
  std::string last_tagged;

  void add(const std::string& output) {
    std::istringstream lines(output);
    for (std::string line; std::getline(lines, line);) {
      if (lines.eof()) return;  // without its end: cut off
      ASSERT_FALSE(line.starts_with("refused")) << line;
      const std::string what = line.substr(line.find(' ') + 1);
      if (line.starts_with("model ")) models.insert(what);
      if (line.starts_with("tag ")) last_tagged = what;
      if (line.starts_with("ended ")) identifications.insert(what);
    }
  }
};

void expect_sound(const std::string& path, const Acknowledged& acknowledged) {
  {
    const auto store = test::value_of(ModelStore::open(path));
    const auto models = test::value_of(store->list());
    std::set<std::string> there;
    for (const StoredModel& model : models) {
      EXPECT_EQ(sha256_hex(*canonical_json(model.model)), model.hash);
      there.insert(model.hash);
    }
    for (const std::string& hash : acknowledged.models) EXPECT_TRUE(there.contains(hash)) << hash;
    const auto ended = test::value_of(store->list_identifications(100000));
    std::set<std::string> ids;
    for (const EndedIdentification& identification : ended) ids.insert(identification.id);
    for (const std::string& id : acknowledged.identifications) EXPECT_TRUE(ids.contains(id)) << id;
    if (!acknowledged.last_tagged.empty()) {
      // The tag is where it was asked to be, or where the write that was cut off put it.
      const auto current = test::value_of(store->tagged("contact", "sponge", "current"));
      const auto place = [&](const std::string& hash) {
        for (std::size_t i = 0; i < models.size(); ++i) {
          if (models[i].hash == hash) return i;
        }
        return models.size();
      };
      EXPECT_LE(place(current.hash), place(acknowledged.last_tagged)) << "not an older one";
    }
  }
  SQLite::Database database(path);
  EXPECT_EQ(database.execAndGet("PRAGMA integrity_check").getString(), "ok");
  SQLite::Statement foreign(database, "PRAGMA foreign_key_check");
  EXPECT_FALSE(foreign.executeStep());
}

TEST(ModelStoreCrash, KilledAtAnyMomentItIsReadableAndKeepsWhatWasAcknowledged) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("models.sqlite");
  std::mt19937 random(11);
  Acknowledged acknowledged;
  constexpr int kKills = 60;
  int with_writes = 0;
  for (int kill = 0; kill < kKills; ++kill) {
    test::ChildProcess writer(MODEL_STORE_WRITER, {path, std::to_string(10000 * kill)});
    // Every third is killed while it opens or makes the file; the others in the midst of their writes.
    const std::size_t before = acknowledged.models.size();
    if (kill % 3 != 0) acknowledged.add(writer.read_line() + "\n");
    std::this_thread::sleep_for(std::chrono::microseconds(
        std::uniform_int_distribution<int>(0, kill % 3 == 0 ? 9000 : 25000)(random)));
    writer.signal(SIGKILL);
    EXPECT_EQ(writer.wait(), -SIGKILL) << writer.output();
    acknowledged.add(writer.output());
    if (acknowledged.models.size() > before) ++with_writes;
    if (kill % 10 == 9) expect_sound(path, acknowledged);
  }
  expect_sound(path, acknowledged);
  EXPECT_GE(with_writes, kKills / 3) << "most were to be killed while they wrote";
  RecordProperty("acknowledged_models", static_cast<int>(acknowledged.models.size()));
}

}  // namespace
}  // namespace hapticd::server
