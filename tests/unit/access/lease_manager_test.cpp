#include "server/access/lease_manager.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "tests/support/eventually.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

Identity of(const std::string& name, ConnectionKind kind = ConnectionKind::kLoopback) {
  Identity who;
  who.name = name;
  who.connection = kind;
  who.role = Role::kOperator;
  return who;
}

/// Records the effects of the manager on the rest of the daemon.
struct Daemon {
  std::atomic<std::uint64_t> published{0};
  std::atomic<int> lost{0};
  std::atomic<std::uint64_t> lost_number{0};
  std::atomic<int> expired{0};
  std::atomic<LeaseExpiry> action{LeaseExpiry::kOfConnection};

  LeaseManager::Effects effects() {
    return {[this](std::uint64_t number) {
              published = number;
              return std::uint64_t{7};
            },
            [this](LeaseExpiry what) {
              action = what;
              ++expired;
            },
            [this](std::uint64_t number, const hal::Error&) {
              lost_number = number;
              ++lost;
            }};
  }
};

class LeaseManagerTest : public testing::Test {
 protected:
  Daemon daemon;
  LeaseManager leases{daemon.effects(), seconds(0)};
  Identity anna = of("user:anna");
  Identity ben = of("user:ben");
};

TEST_F(LeaseManagerTest, LetsAllCommandWhileNoOneHoldsIt) {
  const auto admitted = test::value_of(leases.admit(anna, "", LeaseRule::kWhenTaken));
  EXPECT_EQ(admitted.number, daemon.published.load());
  EXPECT_FALSE(admitted.by_holder);
}

TEST_F(LeaseManagerTest, AnotherProgramOfTheHolderMayDoWhatIsForItsIdentity) {
  constexpr auto kIdentity = LeaseManager::Holder::kIdentity;
  const auto granted = test::value_of(leases.acquire(anna, {}));
  const auto admitted = test::value_of(leases.admit(anna, "", LeaseRule::kRequired, kIdentity));
  EXPECT_EQ(admitted.number, granted.lease.number);
  EXPECT_EQ(leases.admit(anna, "", LeaseRule::kRequired).refusal().reason, Reason::kLeaseHeld);
  EXPECT_EQ(leases.admit(ben, "", LeaseRule::kWhenTaken, kIdentity).refusal().reason, Reason::kLeaseHeld);
  EXPECT_EQ(leases.admit(anna, "of no lease", LeaseRule::kWhenTaken, kIdentity).refusal().reason,
            Reason::kLeaseLost);
}

TEST_F(LeaseManagerTest, NeedsOneWhereItIsRequired) {
  EXPECT_EQ(test::refusal_of(leases.admit(anna, "", LeaseRule::kRequired)).reason, Reason::kLeaseRequired);
}

TEST_F(LeaseManagerTest, LetsOnlyItsHolderCommand) {
  const auto granted = test::value_of(leases.acquire(anna, {.purpose = "calibration"}));
  EXPECT_EQ(granted.changed_after_tick, 7U);
  EXPECT_EQ(granted.lease.number, daemon.published.load());
  EXPECT_TRUE(test::value_of(leases.admit(anna, granted.token, LeaseRule::kRequired)).by_holder);
  const auto other = test::refusal_of(leases.admit(ben, "", LeaseRule::kWhenTaken));
  EXPECT_EQ(other.reason, Reason::kLeaseHeld);
  EXPECT_EQ(other.error.what, "another client, user:anna, has controlled the rig for 0 s: calibration");
  EXPECT_FALSE(leases.admit(anna, "", LeaseRule::kWhenTaken)) << "another program of the same user";
  EXPECT_FALSE(leases.admit(ben, granted.token, LeaseRule::kWhenTaken))
      << "a token that was seen is of no use";
  EXPECT_FALSE(leases.admit(anna, granted.token + "0", LeaseRule::kWhenTaken));
  EXPECT_FALSE(leases.acquire(ben, {}));
}

TEST_F(LeaseManagerTest, ReturnedLetsAllCommandAgainUnderAnotherNumber) {
  const auto granted = test::value_of(leases.acquire(anna, {}));
  leases.give_back(ben, granted.token);
  EXPECT_TRUE(leases.snapshot().lease) << "only its holder returns it";
  leases.give_back(anna, granted.token);
  EXPECT_FALSE(leases.snapshot().lease);
  EXPECT_EQ(leases.snapshot().change, LeaseChange::kReturned);
  EXPECT_TRUE(leases.admit(ben, "", LeaseRule::kWhenTaken));
  EXPECT_GT(daemon.published.load(), granted.lease.number);
  EXPECT_EQ(daemon.lost.load(), 0) << "it wanted that";
  const auto late = test::refusal_of(leases.admit(anna, granted.token, LeaseRule::kWhenTaken));
  EXPECT_EQ(late.reason, Reason::kLeaseLost);
}

TEST_F(LeaseManagerTest, TakenNamesTheTakerToItsFormerHolder) {
  const auto granted = leases.acquire(anna, {});
  const auto taken = test::value_of(leases.take(ben, {}, "the demo begins", {}));
  EXPECT_EQ(daemon.lost_number.load(), granted->lease.number);
  const auto late = test::refusal_of(leases.admit(anna, granted->token, LeaseRule::kWhenTaken));
  constexpr auto kTaken = "the lease was taken by user:ben: the demo begins";
  EXPECT_EQ(late.error.what, kTaken);
  EXPECT_EQ(leases.lost(granted->lease.number)->error.what, kTaken);
  EXPECT_FALSE(leases.lost(taken.lease.number));
  EXPECT_FALSE(leases.lost(0)) << "the daemon's own commands";
  leases.give_back(ben, taken.token);
  EXPECT_EQ(leases.renew(anna, granted->token).refusal().error.what, kTaken) << "also once it was returned";
}

TEST_F(LeaseManagerTest, ExpiresWithItsActionWhenItsHolderIsNotHeardOf) {
  for (const LeaseExpiry action : {LeaseExpiry::kKeep, LeaseExpiry::kRampToZero, LeaseExpiry::kStop}) {
    LeaseTerms terms;
    terms.ttl = milliseconds(20);
    terms.on_expiry = action;
    const int before = daemon.lost;  // the last of the effects
    const auto granted = test::value_of(leases.acquire(anna, terms));
    const auto until = LeaseManager::Clock::now() + seconds(60);
    while (daemon.lost == before && LeaseManager::Clock::now() < until)
      std::this_thread::sleep_for(milliseconds(1));
    EXPECT_EQ(daemon.action.load(), action);
    EXPECT_EQ(daemon.lost_number.load(), granted.lease.number);
    EXPECT_EQ(leases.snapshot().change, LeaseChange::kExpired);
    EXPECT_FALSE(leases.renew(anna, granted.token));
  }
}

TEST_F(LeaseManagerTest, EachUseRenewsIt) {
  LeaseTerms terms;
  terms.ttl = seconds(600);
  const auto granted = leases.acquire(anna, terms);
  const auto remaining_s = [this] { return leases.snapshot().lease->remaining_s; };
  const auto expect_renewed = [&](const char* by, auto use) {
    const double full_s = remaining_s();
    EXPECT_TRUE(test::eventually([&] { return remaining_s() < full_s - 0.001; }));
    // Whatever stops this thread from here on also counts as time that has passed.
    const auto from = std::chrono::steady_clock::now();
    use();
    const double after_s = remaining_s();
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - from;
    EXPECT_GE(after_s, 600.0 - passed.count()) << by;
  };
  expect_renewed("a command", [&] { (void)leases.admit(anna, granted->token, LeaseRule::kRequired); });
  expect_renewed("any other call", [&] { leases.note_use(anna, granted->token); });
  expect_renewed("a renewal", [&] { (void)leases.renew(anna, granted->token); });
  const double before_s = remaining_s();
  EXPECT_TRUE(test::eventually([&] { return remaining_s() < before_s; }));
  leases.note_use(ben, granted->token);
  EXPECT_LT(remaining_s(), before_s) << "not those of others";
}

TEST_F(LeaseManagerTest, RampsTheForceOfRemoteHoldersByDefault) {
  const auto remote =
      test::value_of(leases.acquire(of("spiffe://lab/hapticd/operator/anna", ConnectionKind::kTls), {}));
  EXPECT_EQ(remote.lease.terms.on_expiry, LeaseExpiry::kRampToZero);
  EXPECT_EQ(test::value_of(leases.take(anna, {}, "why", {})).lease.terms.on_expiry, LeaseExpiry::kKeep);
}

TEST(LeaseNotice, InformsTheHolderBeforeItIsTaken) {
  Daemon daemon;
  LeaseManager leases(daemon.effects(), milliseconds(200));
  LeaseTerms terms;
  terms.ttl = seconds(60);
  const auto granted = leases.acquire(of("user:anna"), terms);
  const std::uint64_t seen = leases.snapshot().version;
  std::thread taker([&] { EXPECT_TRUE(leases.take(of("user:ben"), {}, "why", {})); });
  const LeaseSnapshot announced = leases.await_change(seen, LeaseManager::Clock::now() + seconds(60));
  EXPECT_EQ(announced.taker, "user:ben");
  EXPECT_EQ(announced.take_reason, "why");
  ASSERT_TRUE(announced.lease);
  EXPECT_EQ(announced.lease->holder, "user:anna") << "it holds it still";
  taker.join();
  EXPECT_EQ(leases.snapshot().lease->holder, "user:ben");
}

TEST(LeaseNotice, IsGivenUpWithTheCall) {
  Daemon daemon;
  LeaseManager leases(daemon.effects(), seconds(60));
  LeaseTerms terms;
  terms.ttl = seconds(60);
  ASSERT_TRUE(leases.acquire(of("user:anna"), terms));
  Caller caller{.deadline = Caller::Clock::now() + milliseconds(50)};
  EXPECT_EQ(test::refusal_of(leases.take(of("user:ben"), {}, "why", caller)).kind,
            RefusalKind::kDeadlineExceeded);
  EXPECT_EQ(leases.snapshot().lease->holder, "user:anna");
  EXPECT_TRUE(leases.snapshot().taker.empty());
}

TEST(LeaseNotice, IsNotGivenToAHolderThatIsNotHeardOf) {
  Daemon daemon;
  LeaseManager leases(daemon.effects(), seconds(600));
  LeaseTerms terms;
  terms.ttl = milliseconds(100);
  ASSERT_TRUE(leases.acquire(of("user:anna"), terms));
  ASSERT_TRUE(test::eventually([&] {
    const auto lease = leases.snapshot().lease;
    return !lease || lease->is_stale;  // a busy machine may look only when it has expired
  }));
  EXPECT_TRUE(leases.take(of("user:ben"), {}, "why", {}));
}

/// Effects of which one lasts until it is let go, once it is armed.
class SlowDaemon {
 public:
  enum class Effect { kNone, kPublish, kExpired, kLost };

  LeaseManager::Effects effects() {
    return {[this](std::uint64_t) {
              happens(Effect::kPublish);
              return std::uint64_t{7};
            },
            [this](LeaseExpiry) { happens(Effect::kExpired); },
            [this](std::uint64_t, const hal::Error&) { happens(Effect::kLost); }};
  }
  void arm(Effect which) { slow_ = which; }
  void await_begin() const { begun_.wait(false); }
  void let_go() {
    let_go_ = true;
    let_go_.notify_all();
  }
  std::vector<Effect> order() const {
    const std::lock_guard lock(mutex_);
    return order_;
  }

 private:
  void happens(Effect which) {
    {
      const std::lock_guard lock(mutex_);
      order_.push_back(which);
    }
    if (slow_ != which) return;
    begun_ = true;
    begun_.notify_all();
    let_go_.wait(false);
  }

  std::atomic<Effect> slow_{Effect::kNone};
  std::atomic<bool> begun_{false};
  std::atomic<bool> let_go_{false};
  mutable std::mutex mutex_;
  std::vector<Effect> order_;
};

/// All that others ask of the manager; returns only if none of it waits.
void ask_everything(LeaseManager& leases) {
  const Identity other = of("user:other");
  (void)leases.admit(other, "", LeaseRule::kWhenTaken);
  (void)leases.admit(other, "no token", LeaseRule::kRequired);
  leases.note_use(other, "no token");
  (void)leases.renew(other, "no token");
  leases.give_back(other, "no token");
  const LeaseSnapshot now = leases.snapshot();
  (void)leases.await_change(now.version - 1, LeaseManager::Clock::now() + seconds(600));
  (void)leases.lost(now.number - 1);
  (void)leases.ended();
}

TEST(LeaseEffects, OneThatLastsHoldsUpNoOtherCall) {
  using Effect = SlowDaemon::Effect;
  for (const Effect slow : {Effect::kPublish, Effect::kExpired, Effect::kLost}) {
    SlowDaemon daemon;
    LeaseManager leases(daemon.effects(), seconds(0));
    LeaseTerms terms;
    terms.ttl = slow == Effect::kExpired ? milliseconds(20) : milliseconds(600'000);
    if (slow != Effect::kPublish) daemon.arm(slow);  // no other effect follows from acquiring it
    ASSERT_TRUE(leases.acquire(of("user:anna"), terms));
    daemon.arm(slow);
    std::thread taker;  // an expiry is noticed by the manager's own thread
    if (slow != Effect::kExpired)
      taker = std::thread([&] { (void)leases.take(of("user:ben"), {}, "why", {}); });
    daemon.await_begin();
    ask_everything(leases);
    const auto acquired = leases.acquire(of("user:carla"), {});
    EXPECT_EQ(static_cast<bool>(acquired), slow == Effect::kExpired) << "of the two others one holds it";
    daemon.let_go();
    if (taker.joinable()) taker.join();
  }
}

TEST(LeaseEffects, TheForceComesFirst) {
  using Effect = SlowDaemon::Effect;
  SlowDaemon daemon;
  LeaseManager leases(daemon.effects(), seconds(0));
  LeaseTerms terms;
  terms.ttl = milliseconds(20);
  ASSERT_TRUE(leases.acquire(of("user:anna"), terms));
  ASSERT_TRUE(test::eventually([&] { return daemon.order().size() >= 5; }));
  EXPECT_EQ(daemon.order(), (std::vector<Effect>{Effect::kPublish, Effect::kPublish, Effect::kPublish,
                                                 Effect::kExpired, Effect::kLost}));
}

TEST(LeaseEffects, AnEffectMayAskTheManager) {
  LeaseManager* asked = nullptr;
  std::atomic<int> answers{0};
  LeaseManager::Effects effects;
  effects.lost = [&](std::uint64_t number, const hal::Error&) {
    if (asked->lost(number) && asked->snapshot().number > number) ++answers;
  };
  LeaseManager leases(std::move(effects), seconds(0));
  asked = &leases;
  ASSERT_TRUE(leases.acquire(of("user:anna"), {}));
  ASSERT_TRUE(leases.take(of("user:ben"), {}, "why", {}));
  EXPECT_EQ(answers.load(), 1);
}

TEST(LeaseRace, OneOfManyGetsIt) {
  Daemon daemon;
  LeaseManager leases(daemon.effects(), seconds(0));
  std::atomic<int> granted{0};
  std::vector<std::thread> clients;
  for (int i = 0; i < 8; ++i) {
    clients.emplace_back([&, i] {
      if (leases.acquire(of("user:" + std::to_string(i)), {})) ++granted;
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(granted.load(), 1);
}

}  // namespace
}  // namespace hapticd::server
