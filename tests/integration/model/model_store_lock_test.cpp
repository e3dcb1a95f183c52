// A store that another process keeps locked, or that was moved or deleted under the daemon.

#include <SQLiteCpp/SQLiteCpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <future>
#include <thread>
#include <vector>

#include "server/model/store/model_store.h"
#include "tests/support/model_examples.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

using test::example_contact;
using test::TemporaryFolder;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::hours kEver{1};

class LockedStore : public testing::Test {
 protected:
  LockedStore() : store_(std::move(*ModelStore::open(path_))) {
    hash_ = store_->add(example_contact("sponge"))->hash;
  }
  /// Locks as another process would.
  void lock() {
    other_.emplace(path_, SQLite::OPEN_READWRITE);
    other_->exec("BEGIN EXCLUSIVE");
  }
  void unlock() { other_.reset(); }

  TemporaryFolder folder_;
  const std::string path_ = folder_.path("models.sqlite");
  std::unique_ptr<ModelStore> store_;
  std::string hash_;
  std::optional<SQLite::Database> other_;
};

TEST_F(LockedStore, IsNotWaitedForByWhoDoesNotAskFor) {
  lock();
  const auto refused = store_->tag(hash_, "current");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.refusal().kind, RefusalKind::kUnavailable);
  EXPECT_EQ(refused.refusal().error.what, "another process keeps the store of models locked");
  unlock();
  EXPECT_TRUE(store_->tag(hash_, "current"));
}

TEST_F(LockedStore, IsWaitedForByManyAtOnceWhileOthersAreServed) {
  lock();
  constexpr int kWaiting = 8;
  std::atomic<int> begun{0};
  std::vector<std::future<bool>> waiting;
  for (int i = 0; i < kWaiting; ++i) {
    waiting.push_back(std::async(std::launch::async, [&, i] {
      ++begun;
      return static_cast<bool>(store_->tag(hash_, "tag_" + std::to_string(i), Clock::now() + kEver));
    }));
  }
  while (begun < kWaiting) std::this_thread::yield();
  // Would wait for an hour behind them if they waited under the store's own lock.
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(store_->get(hash_));
  EXPECT_FALSE(store_->tag(hash_, "impatient"));
  for (auto& one : waiting) EXPECT_EQ(one.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
  unlock();
  for (auto& one : waiting) EXPECT_TRUE(one.get());
  EXPECT_EQ(store_->get(hash_)->tags.size(), kWaiting);
}

class MovedStore : public LockedStore {
 protected:
  template <class T>
  void expect_refused(const Outcome<T>& outcome) {
    ASSERT_FALSE(outcome) << "was acknowledged, and is lost";
    EXPECT_EQ(outcome.refusal().kind, RefusalKind::kFailedPrecondition);
    EXPECT_EQ(outcome.refusal().error.what,
              "the store of models was moved or deleted while hapticd runs: nothing was stored");
    EXPECT_EQ(outcome.refusal().error.where, path_);
  }
  void expect_every_change_refused() {
    expect_refused(store_->add(example_contact("rubber")));
    expect_refused(store_->tag(hash_, "current"));
    expect_refused(store_->erase(hash_, {}));
    expect_refused(store_->record_identification({}));
    EXPECT_TRUE(store_->export_json(hash_)) << "what was stored can be saved";
  }
};

TEST_F(MovedStore, DeletedItAcknowledgesNothing) {
  for (const char* suffix : {"", "-wal", "-shm"}) std::filesystem::remove(path_ + suffix);
  expect_every_change_refused();
}

TEST_F(MovedStore, ReplacedByAnotherItAcknowledgesNothing) {
  const std::string away = folder_.path("away.sqlite");
  for (const char* suffix : {"", "-wal", "-shm"}) std::filesystem::rename(path_ + suffix, away + suffix);
  { const auto another = ModelStore::open(path_); }
  expect_every_change_refused();
  for (const char* suffix : {"", "-wal", "-shm"}) {
    std::filesystem::remove(path_ + suffix);
    std::filesystem::rename(away + suffix, path_ + suffix);
  }
  EXPECT_TRUE(store_->tag(hash_, "current")) << "put back, it goes on";
}

}  // namespace
}  // namespace hapticd::server
