#include "server/model/store/model_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "server/model/canonical_text.h"
#include "server/model/model_json.h"
#include "server/model/store/default_model_store.h"
#include "server/model/store/model_diff.h"
#include "server/model/store/model_library.h"
#include "tests/support/model_examples.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

using test::example_contact;
using test::example_friction;
using test::TemporaryFolder;

std::unique_ptr<ModelStore> opened(const std::string& path) {
  auto store = ModelStore::open(path);
  EXPECT_TRUE(store) << store.error().text();
  return std::move(*store);
}

std::string hash_of(const rt::IdentifiedModel& model) {
  return sha256_hex(*canonical_json(model));
}

std::string add(ModelStore& store, const rt::IdentifiedModel& model) {
  const auto stored = store.add(model);
  EXPECT_TRUE(stored) << stored.refusal().error.text();
  return stored->hash;
}

template <class T>
void expect_refused(const Outcome<T>& outcome, RefusalKind kind, const std::string& what) {
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.refusal().kind, kind);
  EXPECT_EQ(outcome.refusal().error.what, what) << outcome.refusal().error.text();
}

/// Everything in a folder, so that it shows when one file was touched.
std::map<std::string, std::string> contents(const std::string& folder) {
  std::map<std::string, std::string> all;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    all[entry.path().filename()] = test::file_text(entry.path());
  }
  return all;
}

TEST(ModelStore, KeepsModelsAcrossItsLife) {
  const TemporaryFolder folder;
  const std::string path = folder.path("state/hapticd/models.sqlite");  // made with its folders
  const rt::IdentifiedModel model = example_contact("sponge");
  std::string hash;
  {
    const auto store = opened(path);
    EXPECT_FALSE(store->in_memory());
    hash = add(*store, model);
    EXPECT_EQ(hash, hash_of(model));
    EXPECT_TRUE(store->tag(hash, "current"));
  }
  const auto store = opened(path);
  const auto stored = test::value_of(store->get(hash));
  EXPECT_EQ(*canonical_json(stored.model), *canonical_json(model));
  EXPECT_EQ(stored.tags, std::vector<std::string>{"current"});
  EXPECT_GT(stored.stored_at_unix_s, 1'600'000'000);
}

TEST(ModelStore, AddingTheSameAgainChangesNothing) {
  const auto store = opened("");
  EXPECT_TRUE(store->in_memory());
  const std::string hash = add(*store, example_contact("sponge"));
  ASSERT_TRUE(store->tag(hash, "mine"));
  const auto again = test::value_of(store->add(example_contact("sponge")));
  EXPECT_EQ(again.hash, hash);
  EXPECT_EQ(again.tags, std::vector<std::string>{"mine"});
  EXPECT_EQ(store->list()->size(), 1U);
  rt::IdentifiedModel unfit = example_contact("sponge");
  unfit.residual = std::nan("");
  expect_refused(store->add(unfit), RefusalKind::kInvalidArgument, "residual is out of range");
}

TEST(ModelStore, ListsNewestFirstAndFilters) {
  const auto store = opened("");
  const std::string first = add(*store, example_contact("sponge", 1));
  const std::string second = add(*store, example_contact("foam", 2));
  const std::string third = add(*store, example_friction("sponge"));
  const std::string fourth = add(*store, test::example_of_rig(test::example_tool()));
  ASSERT_TRUE(store->tag(third, "current"));
  const auto hashes = [&](const ModelFilter& filter) {
    std::vector<std::string> all;
    const auto models = store->list(filter);
    EXPECT_TRUE(models);
    for (const StoredModel& model : *models) all.push_back(model.hash);
    return all;
  };
  using Hashes = std::vector<std::string>;
  EXPECT_EQ(hashes({}), (Hashes{fourth, third, second, first}));
  EXPECT_EQ(hashes({"contact", "", ""}), (Hashes{second, first}));
  EXPECT_EQ(hashes({"", "sponge", ""}), (Hashes{third, first}));
  EXPECT_EQ(hashes({"", "", "current"}), (Hashes{third}));
  EXPECT_EQ(hashes({"contact", "", "current"}), Hashes{});
}

TEST(ModelStore, AnyUnambiguousBeginningOfAHashWillDo) {
  const auto store = opened("");
  // Among so many some begin with the same six digits.
  std::vector<std::string> hashes;
  for (int i = 0; i < 9000; ++i) hashes.push_back(hash_of(example_contact("x", i)));
  std::vector<std::pair<std::string, int>> sorted;
  for (int i = 0; i < 9000; ++i) sorted.emplace_back(hashes[static_cast<std::size_t>(i)], i);
  std::sort(sorted.begin(), sorted.end());
  const auto twins = std::adjacent_find(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return a.first.substr(0, 6) == b.first.substr(0, 6);
  });
  ASSERT_NE(twins, sorted.end());
  const auto [hash, number] = *twins;
  const auto [other_hash, other_number] = *(twins + 1);
  add(*store, example_contact("x", number));
  EXPECT_EQ(store->get(hash.substr(0, 6))->hash, hash);
  std::string upper = hash.substr(0, 20);
  std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) { return std::toupper(c); });
  EXPECT_EQ(store->get(upper)->hash, hash);
  add(*store, example_contact("x", other_number));
  const auto ambiguous = store->get(hash.substr(0, 6));
  expect_refused(ambiguous, RefusalKind::kInvalidArgument, "the beginning of the hash is ambiguous");
  EXPECT_EQ(ambiguous.refusal().error.limit, hash + ", " + other_hash);
  EXPECT_EQ(store->get(hash.substr(0, 16))->hash, hash);
  for (const char* bad : {"", "12345", "12345g", "../../x", "%", "1234567 "}) {
    expect_refused(store->get(bad), RefusalKind::kInvalidArgument, "not the hash of a model");
  }
  const std::string missing = hash.front() == '0' ? "111111" : "000000";
  expect_refused(store->get(missing), RefusalKind::kNotFound, "no such model is stored");
}

TEST(ModelStore, ATagMovesAmongModelsOfOneKindAndSubject) {
  const auto store = opened("");
  const std::string first = add(*store, example_contact("sponge", 1));
  const std::string second = add(*store, example_contact("sponge", 2));
  const std::string foam = add(*store, example_contact("foam"));
  const std::string rod = add(*store, example_friction("sponge"));
  const std::string bearing = add(*store, example_friction("sponge", rt::Tip::kBallBearing));
  for (const std::string& hash : {first, foam, rod, bearing}) ASSERT_TRUE(store->tag(hash, "current"));
  EXPECT_EQ(store->tagged("contact", "sponge", "current")->hash, first);
  ASSERT_TRUE(store->tag(second.substr(0, 10), "current"));
  EXPECT_EQ(store->tagged("contact", "sponge", "current")->hash, second);
  EXPECT_TRUE(store->get(first)->tags.empty()) << "it was taken from it";
  for (const std::string& hash : {foam, rod, bearing}) {
    EXPECT_EQ(store->get(hash)->tags, std::vector<std::string>{"current"}) << "another object, kind or tip";
  }
  // Model of the rig: by device and sensor.
  rt::IdentifiedModel tool = test::example_of_rig(test::example_tool());
  rt::IdentifiedModel elsewhere = tool;
  elsewhere.device = "phantom_1_5_high_force";
  const std::string here = add(*store, tool);
  const std::string there = add(*store, elsewhere);
  ASSERT_TRUE(store->tag(here, "current"));
  ASSERT_TRUE(store->tag(there, "current"));
  EXPECT_EQ(store->tagged("tool", "phantom_1_0/nano17_si_25", "current")->hash, here);

  expect_refused(store->tag(first, "a b"), RefusalKind::kInvalidArgument, "not a name for a tag");
  ASSERT_TRUE(store->tag(first, "soft"));
  const auto untagged = store->untag(first, "sfot");
  expect_refused(untagged, RefusalKind::kNotFound, "the model has no such tag");
  EXPECT_EQ(untagged.refusal().error.remedy, "did you mean 'soft'?");
  EXPECT_TRUE(store->untag(first, "soft")->tags.empty());
  expect_refused(store->tagged("contact", "sponge", "soft"), RefusalKind::kNotFound,
                 "no contact model has this tag");
}

TEST(ModelStore, ErasesWithTagsButNotWhatIsInUse) {
  const auto store = opened("");
  const std::string hash = add(*store, example_contact("sponge"));
  ASSERT_TRUE(store->tag(hash, "current"));
  const auto refused =
      store->erase(hash.substr(0, 8), [&](const std::string& whole) { return whole == hash; });
  expect_refused(refused, RefusalKind::kFailedPrecondition, "the loaded scene works with this model");
  EXPECT_TRUE(store->get(hash));
  EXPECT_EQ(*store->erase(hash.substr(0, 8), [](const std::string&) { return false; }), hash);
  expect_refused(store->get(hash), RefusalKind::kNotFound, "no such model is stored");
  EXPECT_FALSE(store->contains(hash));
  expect_refused(store->tagged("contact", "sponge", "current"), RefusalKind::kNotFound,
                 "no contact model has this tag");
  expect_refused(store->erase(hash, nullptr), RefusalKind::kNotFound, "no such model is stored");
}

TEST(ModelStore, ExportsAndImportsUnderTheSameHash) {
  const auto here = opened("");
  const auto there = opened("");
  const std::string hash = add(*here, example_contact("sponge"));
  ASSERT_TRUE(here->tag(hash, "current"));
  const auto json = test::value_of(here->export_json(hash.substr(0, 12)));
  const auto imported = test::value_of(there->import_json(json));
  EXPECT_EQ(imported.hash, hash);
  EXPECT_TRUE(imported.tags.empty()) << "tags stay where they are";
  EXPECT_TRUE(there->import_json(json)) << "once more changes nothing";
  EXPECT_EQ(there->list()->size(), 1U);
  std::string edited = json;
  edited.replace(edited.find("\"exponent\":1.7"), 14, "\"exponent\":1.8");
  EXPECT_EQ(test::refusal_of(there->import_json(edited)).kind, RefusalKind::kInvalidArgument);
  EXPECT_EQ(there->list()->size(), 1U);
}

EndedIdentification some_identification(int i) {
  return {"contact-" + std::to_string(i),
          "contact",
          "sponge",
          "converged",
          1'700'000'000 + i,
          "ab",
          "no \"problem\""};
}

TEST(ModelStore, RemembersIdentificationsThatEnded) {
  const TemporaryFolder folder;
  const std::string path = folder.path("models.sqlite");
  {
    const auto store = opened(path);
    EXPECT_TRUE(store->list_identifications(10)->empty());
    for (int i = 0; i < 3; ++i) {
      const auto sequence = test::value_of(store->record_identification(some_identification(i)));
      EXPECT_EQ(sequence, static_cast<std::uint64_t>(i + 1));
    }
  }
  const auto ended = test::value_of(opened(path)->list_identifications(2));
  ASSERT_EQ(ended.size(), 2U);
  EXPECT_EQ(ended[0].id, "contact-2");
  EXPECT_EQ(ended[0].ended_at_unix_s, 1'700'000'002);
  EXPECT_EQ(ended[0].problem, "no \"problem\"");
  EXPECT_EQ(ended[1].id, "contact-1");

  const auto memory = opened("");
  for (int i = 0; i < 1005; ++i) ASSERT_TRUE(memory->record_identification(some_identification(i)));
  const auto kept = memory->list_identifications(100000);
  EXPECT_EQ(kept->size(), 1000U) << "bounded";
  EXPECT_EQ(kept->front().id, "contact-1004");
}

TEST(ModelStore, ServesManyThreadsAndASecondProcess) {
  const TemporaryFolder folder;
  const std::string path = folder.path("models.sqlite");
  constexpr int kThreads = 4;
  constexpr int kEach = 15;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&path, t] {
      const auto store = opened(path);  // a separate connection, as another process has
      for (int i = 0; i < kEach; ++i) {
        const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
        const auto stored = test::value_of(store->add(example_contact("x", 100 * t + i), until));
        ASSERT_TRUE(store->tag(stored.hash, "current", until));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const auto store = opened(path);
  EXPECT_EQ(store->list()->size(), static_cast<std::size_t>(kThreads * kEach));
  EXPECT_EQ(store->list({"", "", "current"})->size(), 1U);
}

// -- files of other times and kinds

/// Schema as version 1 made it.
constexpr const char* kVersion1 = R"sql(
CREATE TABLE models (sequence INTEGER PRIMARY KEY AUTOINCREMENT, hash TEXT NOT NULL UNIQUE CHECK (length(hash) = 64),
  kind TEXT NOT NULL, subject TEXT NOT NULL, object TEXT NOT NULL, content TEXT NOT NULL,
  stored_at INTEGER NOT NULL) STRICT;
CREATE INDEX models_by_subject ON models (kind, subject);
CREATE TRIGGER models_are_immutable BEFORE UPDATE ON models
BEGIN SELECT RAISE(ABORT, 'a stored model never changes'); END;
CREATE TABLE tags (kind TEXT NOT NULL, subject TEXT NOT NULL, tag TEXT NOT NULL,
  hash TEXT NOT NULL REFERENCES models (hash) ON DELETE CASCADE, PRIMARY KEY (kind, subject, tag)) STRICT;
CREATE INDEX tags_by_hash ON tags (hash);
PRAGMA application_id = 1752200292;
PRAGMA user_version = 1;
)sql";

/// A store of contact models of one sponge as version 1 left it, of which one is tagged.
void write_version1(const std::string& path, const std::vector<rt::IdentifiedModel>& models,
                    const rt::IdentifiedModel& current) {
  SQLite::Database old(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  old.exec(kVersion1);
  std::int64_t stored_at = 1'700'000'000;
  for (const rt::IdentifiedModel& model : models) {
    SQLite::Statement row(old,
                          "INSERT INTO models (hash, kind, subject, object, content, stored_at) "
                          "VALUES (?, 'contact', 'sponge', 'sponge', ?, ?)");
    row.bind(1, hash_of(model));
    row.bind(2, *canonical_json(model));
    row.bind(3, stored_at++);
    row.exec();
  }
  SQLite::Statement tag(old, "INSERT INTO tags VALUES ('contact', 'sponge', 'current', ?)");
  tag.bind(1, hash_of(current));
  tag.exec();
}

TEST(ModelStoreFile, OfVersion1IsBroughtUpToDateWithoutLoss) {
  const TemporaryFolder folder;
  const std::string path = folder.path("models.sqlite");
  std::vector<rt::IdentifiedModel> old;
  for (int i = 0; i < 20; ++i) old.push_back(example_contact("sponge", i));
  write_version1(path, old, old[7]);
  for (int time = 0; time < 2; ++time) {
    const auto store = opened(path);
    const auto models = store->list();
    ASSERT_EQ(models->size(), 20U);
    for (std::size_t i = 0; i < 20; ++i) {
      const StoredModel& model = (*models)[19 - i];
      EXPECT_EQ(model.hash, hash_of(old[i]));
      EXPECT_EQ(model.stored_at_unix_s, 1'700'000'000 + static_cast<std::int64_t>(i));
    }
    EXPECT_EQ(store->tagged("contact", "sponge", "current")->hash, hash_of(old[7]));
    EXPECT_TRUE(store->record_identification({"contact-1", "contact", "sponge", "failed", 1, "", ""}));
  }
  EXPECT_EQ(SQLite::Database(path).execAndGet("PRAGMA user_version").getInt(), 3);
}

TEST(ModelStoreFile, OfANewerVersionIsRefusedAndLeftAlone) {
  const TemporaryFolder folder;
  const std::string path = folder.path("models.sqlite");
  {
    opened(path);
    SQLite::Database newer(path, SQLite::OPEN_READWRITE);
    newer.exec("CREATE TABLE of_tomorrow (x); PRAGMA user_version = 4");
  }
  const auto before = contents(folder.path());
  const auto store = ModelStore::open(path);
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().what, "the store of models was written by a newer hapticd");
  EXPECT_EQ(store.error().where, path);
  EXPECT_EQ(store.error().value, "version 4");
  EXPECT_EQ(store.error().limit, "up to version 3");
  EXPECT_TRUE(ModelStore::check(path));
  EXPECT_EQ(contents(folder.path()), before);
}

TEST(ModelStoreFile, ThatIsNoneIsRefusedAndLeftAlone) {
  const TemporaryFolder folder;
  const std::string text = folder.write("notes.txt",
                                        "these are my notes, of more than a hundred bytes, so that they "
                                        "could be taken for the header of a database if no one looked");
  folder.write("short", "x");
  {
    SQLite::Database foreign(folder.path("foreign.sqlite"), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    foreign.exec("CREATE TABLE letters (x)");
    SQLite::Database named(folder.path("named.sqlite"), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    named.exec("PRAGMA application_id = 77; PRAGMA user_version = 1; CREATE TABLE letters (x)");
  }
  const auto before = contents(folder.path());
  for (const char* name : {"notes.txt", "short", "foreign.sqlite", "named.sqlite"}) {
    const auto store = ModelStore::open(folder.path(name));
    ASSERT_FALSE(store) << name;
    EXPECT_EQ(store.error().what, "not a store of models") << name << ": " << store.error().text();
    EXPECT_EQ(store.error().where, folder.path(name));
  }
  EXPECT_EQ(contents(folder.path()), before);
  EXPECT_EQ(test::error_of(ModelStore::open(folder.path())).what, "the store of models is not a file");
  EXPECT_EQ(test::error_of(ModelStore::open(text + "/models.sqlite")).what,
            "the folder of the store of models cannot be made");
}

TEST(ModelStoreFile, ThatIsDamagedIsRefusedWithARemedyAndLeftAlone) {
  const TemporaryFolder folder;
  const std::string path = folder.path("models.sqlite");
  {
    const auto store = opened(path);
    for (int i = 0; i < 40; ++i) add(*store, example_contact("sponge", i));
  }
  const std::string whole = test::file_text(path);
  ASSERT_GT(whole.size(), 40000U);
  const auto expect_damaged = [&](const std::string& bytes, const std::string& how) {
    std::ofstream(path, std::ios::binary) << bytes;
    const auto store = ModelStore::open(path);
    ASSERT_FALSE(store) << how;
    EXPECT_EQ(store.error().what, "the store of models is damaged") << how << ": " << store.error().text();
    EXPECT_NE(store.error().remedy.find("restore it from a copy"), std::string::npos);
    EXPECT_EQ(test::file_text(path), bytes) << how;
  };
  expect_damaged(whole.substr(0, whole.size() / 2), "cut off in the middle");
  expect_damaged(whole.substr(0, 4096), "its first page only");
  expect_damaged(whole.substr(0, whole.size() - 4096), "its last page missing");
  std::string scribbled = whole;
  for (std::size_t i = 4096; i < 12288; ++i) scribbled[i] = static_cast<char>(i * 7);
  expect_damaged(scribbled, "two pages overwritten");
  // Restored it is as good as before.
  std::ofstream(path, std::ios::binary) << whole;
  EXPECT_EQ(opened(path)->list()->size(), 40U);
}

TEST(ModelStoreFile, AModelThatWasAlteredInsideIsReportedAndTheOthersGoOn) {
  const TemporaryFolder folder;
  const std::string path = folder.path("models.sqlite");
  std::string altered;
  {
    const auto store = opened(path);
    altered = add(*store, example_contact("sponge", 1));
    add(*store, example_contact("sponge", 2));
  }
  {
    SQLite::Database database(path, SQLite::OPEN_READWRITE);
    EXPECT_THROW(database.exec("UPDATE models SET stored_at = 1"), SQLite::Exception) << "they never change";
    database.exec("DROP TRIGGER models_are_immutable");
    database.exec("UPDATE models SET content = replace(content, '1.7', '1.8') WHERE hash = '" + altered +
                  "'");
  }
  const auto store = opened(path);
  expect_refused(store->get(altered), RefusalKind::kInternal, "the content of a model does not fit its hash");
  EXPECT_EQ(store->list()->size(), 1U);
}

TEST(ModelStoreFile, CheckingMakesNothing) {
  const TemporaryFolder folder;
  EXPECT_FALSE(ModelStore::check(folder.path("new/models.sqlite")));
  EXPECT_TRUE(contents(folder.path()).empty());
}

TEST(DefaultModelStore, IsWhereStateBelongs) {
  for (const char* name : {"STATE_DIRECTORY", "XDG_STATE_HOME", "HOME"}) unsetenv(name);
  EXPECT_EQ(default_model_store(), "");
  setenv("HOME", "/home/x", 1);
  EXPECT_EQ(default_model_store(), "/home/x/.local/state/hapticd/models.sqlite");
  setenv("XDG_STATE_HOME", "not/absolute", 1);
  EXPECT_EQ(default_model_store(), "/home/x/.local/state/hapticd/models.sqlite") << "to be ignored";
  setenv("XDG_STATE_HOME", "/state", 1);
  EXPECT_EQ(default_model_store(), "/state/hapticd/models.sqlite");
  setenv("STATE_DIRECTORY", "/var/lib/hapticd:/var/lib/other", 1);
  EXPECT_EQ(default_model_store(), "/var/lib/hapticd/models.sqlite");
}

// -- differences

TEST(ModelDifference, TellsEveryParameterAndWhatElseIsOther) {
  StoredModel a;
  a.model = example_contact("sponge");
  a.model.parameters = {{"K", "N/mm", 2.0, 0.3},
                        {"B", "s", 0.0, 0.1},
                        {"only_a", "1", 1.0, 0.1},
                        {"open", "1", 1.0, std::numeric_limits<double>::infinity()}};
  StoredModel b = a;
  b.model.parameters = {
      {"K", "N/mm", 3.0, 0.4}, {"B", "s", 0.2, 0.0}, {"open", "1", 2.0, 0.1}, {"only_b", "1", 5.0, 0.1}};
  b.model.device = "phantom_1_5";
  b.model.converged = false;
  const auto apart = test::value_of(difference(a, b));
  ASSERT_EQ(apart.parameters.size(), 5U);
  EXPECT_EQ(apart.parameters[0].relative, 0.5);
  EXPECT_NEAR(*apart.parameters[0].deviations, 2.0, 1e-12);
  EXPECT_FALSE(apart.parameters[1].relative) << "nothing is so many times zero";
  EXPECT_NEAR(*apart.parameters[1].deviations, 2.0, 1e-12);
  EXPECT_FALSE(apart.parameters[2].value_b);
  EXPECT_FALSE(apart.parameters[3].deviations) << "nothing is known of it";
  EXPECT_FALSE(apart.parameters[4].value_a);
  EXPECT_EQ(apart.remarks, (std::vector<std::string>{"device: 'phantom_1_0' against 'phantom_1_5'",
                                                     "only the first had converged"}));
  b.model = example_friction("sponge");
  expect_refused(difference(a, b), RefusalKind::kInvalidArgument,
                 "models of different kinds have nothing to compare");
}

// -- what scenes get

std::shared_ptr<ModelStore> in_memory() {
  return opened("");
}

TEST(ModelLibrary, AStoredModelTakesThePlaceOfAFilesPart) {
  const auto store = in_memory();
  const ModelLibrary library("", store);
  const auto file = library.find("sponge_cut");
  ASSERT_TRUE(file && file->creep && file->hunt_crossley && file->rod_friction);

  rt::IdentifiedModel only_power = example_contact("sponge_cut", 3);
  std::get<rt::ContactModel>(only_power.content).creep.reset();
  const std::string power = add(*store, only_power);
  EXPECT_EQ(library.find("sponge_cut")->identified_on, file->identified_on)
      << "stored, but no one's choice yet";
  ASSERT_TRUE(store->tag(power, "current"));
  auto found = library.find_parts("sponge_cut");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->stored(), std::vector<std::string>{power});
  EXPECT_EQ(found->model.hunt_crossley->parameters.exponent, 1.7);
  EXPECT_EQ(found->model.creep->parameters.displacement_mm, file->creep->parameters.displacement_mm);
  EXPECT_FALSE(found->creep);
  EXPECT_EQ(found->model.max_force_n, std::min(5.8, file->max_force_n)) << "what both cover";

  const std::string friction = add(*store, example_friction("sponge_cut"));
  ASSERT_TRUE(store->tag(friction, "current"));
  ASSERT_TRUE(store->untag(power, "current"));
  found = library.find_parts("sponge_cut");
  EXPECT_EQ(found->stored(), std::vector<std::string>{friction});
  EXPECT_EQ(found->model.rod_friction->kinetic, 0.4);
}

TEST(ModelLibrary, AnObjectMayBeStoredOnlyAndAskedForByTag) {
  const auto store = in_memory();
  const ModelLibrary library("", store);
  const std::string soft = add(*store, example_contact("gel", 1));
  const std::string hard = add(*store, example_contact("gel", 2));
  EXPECT_FALSE(library.contains("gel"));
  ASSERT_TRUE(store->tag(soft, "soft"));
  const hal::Error untagged = test::error_of(library.find("gel"));
  EXPECT_EQ(untagged.what, "no model of 'gel' is tagged 'current'");
  EXPECT_EQ(untagged.limit, "gel@soft");

  ASSERT_TRUE(store->tag(hard, "current"));
  EXPECT_TRUE(library.contains("gel"));
  const auto names = library.names();
  EXPECT_TRUE(std::find(names.begin(), names.end(), "gel") != names.end());
  EXPECT_EQ(library.find_parts("gel")->stored(), std::vector<std::string>{hard});
  EXPECT_EQ(library.find_parts("gel@soft")->stored(), std::vector<std::string>{soft});

  const auto mistyped = test::refusal_of(library.find_parts("gel@sotf"));
  EXPECT_EQ(mistyped.kind, RefusalKind::kNotFound);
  EXPECT_EQ(mistyped.error.what, "no model of 'gel' has the tag 'sotf'");
  EXPECT_EQ(mistyped.error.remedy, "did you mean 'soft'?");
  EXPECT_EQ(library.find_parts("gle@soft").refusal().error.remedy, "did you mean 'gel'?");
  for (const char* bad : {"gel@", "@soft", "gel@a@b", "gel@../x"}) {
    EXPECT_EQ(library.find_parts(bad).refusal().kind, RefusalKind::kInvalidArgument) << bad;
  }
}

TEST(ModelStoreFile, OfVersion2ItsModelsAreOfTheRigThatTheirDataName) {
  const TemporaryFolder folder;
  const std::string path = folder.path("models.sqlite");
  rt::IdentifiedModel simulated = example_contact("sponge", 1);
  simulated.data_reference = "12.0 s on rig 'sim:phantom_1_0'";
  rt::IdentifiedModel real = example_contact("sponge", 2);
  real.data_reference = "12.0 s on rig 'openhaptics+netft'";
  rt::IdentifiedModel recorded = example_contact("sponge", 3);
  write_version1(path, {simulated, real, recorded}, simulated);
  const auto store = std::move(*ModelStore::open(path, "hardware"));
  EXPECT_EQ(store->get(hash_of(simulated))->rig_kind, "simulated");
  EXPECT_EQ(store->get(hash_of(real))->rig_kind, "hardware");
  EXPECT_EQ(store->get(hash_of(recorded))->rig_kind, "");
  EXPECT_FALSE(store->tagged("contact", "sponge", "current"));
  EXPECT_TRUE(std::move(*ModelStore::open(path, "simulated"))->tagged("contact", "sponge", "current"));
}

TEST(ModelLibrary, WhatWasFoundOnASimulatedRigIsNotCurrentOnAnother) {
  const TemporaryFolder folder;
  const std::string path = folder.path("models.sqlite");
  const std::shared_ptr<ModelStore> simulated = std::move(*ModelStore::open(path, "simulated"));
  const std::string found = add(*simulated, example_contact("gel", 1));
  ASSERT_TRUE(simulated->tag(found, "current"));
  EXPECT_EQ(ModelLibrary("", simulated).find_parts("gel")->stored(), std::vector<std::string>{found});

  const std::shared_ptr<ModelStore> real = std::move(*ModelStore::open(path, "hardware"));
  const ModelLibrary library("", real);
  EXPECT_EQ(test::error_of(library.find("gel")).what,
            "what is stored of 'gel' was identified on a simulated rig, and this is none");
  const auto names = library.names();
  EXPECT_TRUE(std::find(names.begin(), names.end(), "gel") == names.end());
  // A separate tag asks for it.
  ASSERT_TRUE(real->tag(found, "as_simulated"));
  EXPECT_EQ(library.find_parts("gel@as_simulated")->stored(), std::vector<std::string>{found});
  // Its own takes nothing from the other's.
  const std::string own = add(*real, example_contact("gel", 2));
  ASSERT_TRUE(real->tag(own, "current"));
  EXPECT_EQ(library.find_parts("gel")->stored(), std::vector<std::string>{own});
  EXPECT_EQ(ModelLibrary("", simulated).find_parts("gel")->stored(), std::vector<std::string>{found});
  // What came from a recording serves both.
  rt::IdentifiedModel recorded = example_contact("foam", 3);
  recorded.device.clear();
  ASSERT_TRUE(real->tag(add(*real, recorded), "current"));
  EXPECT_TRUE(ModelLibrary("", simulated).contains("foam"));
}

TEST(ModelLibrary, TheRigsOwnModelsAreThoseOfItsDeviceAndSensor) {
  const auto store = in_memory();
  const ModelLibrary library("", store);
  hal::RigInfo rig;
  rig.device.model = "phantom_1_0";
  rig.sensor.model = "nano17_si_25";
  const std::string tool = add(*store, test::example_of_rig(test::example_tool()));
  const std::string structure = add(*store, test::example_of_rig(test::example_structure()));
  EXPECT_FALSE(library.of_rig(rig).tool);
  ASSERT_TRUE(store->tag(tool, "current"));
  ASSERT_TRUE(store->tag(structure, "current"));
  EXPECT_EQ(library.of_rig(rig).tool->hash, tool);
  EXPECT_EQ(library.of_rig(rig).structure->hash, structure);
  EXPECT_FALSE(library.of_rig(rig).gains);
  rig.sensor.model = "another";
  EXPECT_FALSE(library.of_rig(rig).tool);
  EXPECT_EQ(library.of_rig(rig).structure->hash, structure) << "the structure is the device's alone";
  rig.device.model = "another";
  EXPECT_FALSE(library.of_rig(rig).structure);
  rig.device.model = "";
  EXPECT_FALSE(library.of_rig(rig).structure);
}

}  // namespace
}  // namespace hapticd::server
