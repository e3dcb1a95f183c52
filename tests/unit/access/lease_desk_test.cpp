#include "server/access/lease_desk.h"

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

/// What the desk did to the rest of the daemon.
struct Daemon {
  std::atomic<std::uint64_t> published{0};
  std::atomic<int> lost{0};
  std::atomic<std::uint64_t> lost_number{0};
  std::atomic<int> expired{0};
  std::atomic<LeaseExpiry> action{LeaseExpiry::kOfConnection};

  LeaseDesk::Effects effects() {
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

class LeaseDeskTest : public testing::Test {
 protected:
  Daemon daemon;
  LeaseDesk desk{daemon.effects(), seconds(0)};
  Identity anna = of("user:anna");
  Identity ben = of("user:ben");
};

TEST_F(LeaseDeskTest, LetsAllCommandWhileNoOneHoldsIt) {
  const auto admitted = test::value_of(desk.admit(anna, "", LeaseRule::kWhenTaken));
  EXPECT_EQ(admitted.number, daemon.published.load());
  EXPECT_FALSE(admitted.by_holder);
}

TEST_F(LeaseDeskTest, AnotherProgramOfTheHolderMayDoWhatIsForItsIdentity) {
  constexpr auto kIdentity = LeaseDesk::Holder::kIdentity;
  const auto granted = test::value_of(desk.acquire(anna, {}));
  const auto admitted = test::value_of(desk.admit(anna, "", LeaseRule::kRequired, kIdentity));
  EXPECT_EQ(admitted.number, granted.lease.number);
  EXPECT_EQ(desk.admit(anna, "", LeaseRule::kRequired).refusal().reason, Reason::kLeaseHeld);
  EXPECT_EQ(desk.admit(ben, "", LeaseRule::kWhenTaken, kIdentity).refusal().reason, Reason::kLeaseHeld);
  EXPECT_EQ(desk.admit(anna, "of no lease", LeaseRule::kWhenTaken, kIdentity).refusal().reason,
            Reason::kLeaseLost);
}

TEST_F(LeaseDeskTest, NeedsOneWhereItIsRequired) {
  EXPECT_EQ(test::refusal_of(desk.admit(anna, "", LeaseRule::kRequired)).reason, Reason::kLeaseRequired);
}

TEST_F(LeaseDeskTest, LetsOnlyItsHolderCommand) {
  const auto granted = test::value_of(desk.acquire(anna, {.purpose = "calibration"}));
  EXPECT_EQ(granted.changed_after_tick, 7U);
  EXPECT_EQ(granted.lease.number, daemon.published.load());
  EXPECT_TRUE(test::value_of(desk.admit(anna, granted.token, LeaseRule::kRequired)).by_holder);
  const auto other = test::refusal_of(desk.admit(ben, "", LeaseRule::kWhenTaken));
  EXPECT_EQ(other.reason, Reason::kLeaseHeld);
  EXPECT_EQ(other.error.what, "another client, user:anna, has controlled the rig for 0 s: calibration");
  EXPECT_FALSE(desk.admit(anna, "", LeaseRule::kWhenTaken)) << "another program of the same user";
  EXPECT_FALSE(desk.admit(ben, granted.token, LeaseRule::kWhenTaken)) << "a token that was seen is of no use";
  EXPECT_FALSE(desk.admit(anna, granted.token + "0", LeaseRule::kWhenTaken));
  EXPECT_FALSE(desk.acquire(ben, {}));
}

TEST_F(LeaseDeskTest, ReturnedLetsAllCommandAgainUnderAnotherNumber) {
  const auto granted = test::value_of(desk.acquire(anna, {}));
  desk.give_back(ben, granted.token);
  EXPECT_TRUE(desk.snapshot().lease) << "only its holder returns it";
  desk.give_back(anna, granted.token);
  EXPECT_FALSE(desk.snapshot().lease);
  EXPECT_EQ(desk.snapshot().change, LeaseChange::kReturned);
  EXPECT_TRUE(desk.admit(ben, "", LeaseRule::kWhenTaken));
  EXPECT_GT(daemon.published.load(), granted.lease.number);
  EXPECT_EQ(daemon.lost.load(), 0) << "it wanted that";
  const auto late = test::refusal_of(desk.admit(anna, granted.token, LeaseRule::kWhenTaken));
  EXPECT_EQ(late.reason, Reason::kLeaseLost);
}

TEST_F(LeaseDeskTest, TakenNamesTheTakerToItsFormerHolder) {
  const auto granted = desk.acquire(anna, {});
  const auto taken = test::value_of(desk.take(ben, {}, "the demo begins", {}));
  EXPECT_EQ(daemon.lost_number.load(), granted->lease.number);
  const auto late = test::refusal_of(desk.admit(anna, granted->token, LeaseRule::kWhenTaken));
  constexpr auto kTaken = "the lease was taken by user:ben: the demo begins";
  EXPECT_EQ(late.error.what, kTaken);
  EXPECT_EQ(desk.lost(granted->lease.number)->error.what, kTaken);
  EXPECT_FALSE(desk.lost(taken.lease.number));
  EXPECT_FALSE(desk.lost(0)) << "the daemon's own commands";
  desk.give_back(ben, taken.token);
  EXPECT_EQ(desk.renew(anna, granted->token).refusal().error.what, kTaken) << "also once it was returned";
}

TEST_F(LeaseDeskTest, ExpiresWithItsActionWhenItsHolderIsNotHeardOf) {
  for (const LeaseExpiry action : {LeaseExpiry::kKeep, LeaseExpiry::kRampToZero, LeaseExpiry::kStop}) {
    LeaseTerms terms;
    terms.ttl = milliseconds(20);
    terms.on_expiry = action;
    const int before = daemon.lost;  // the last of the effects
    const auto granted = test::value_of(desk.acquire(anna, terms));
    const auto until = LeaseDesk::Clock::now() + seconds(60);
    while (daemon.lost == before && LeaseDesk::Clock::now() < until)
      std::this_thread::sleep_for(milliseconds(1));
    EXPECT_EQ(daemon.action.load(), action);
    EXPECT_EQ(daemon.lost_number.load(), granted.lease.number);
    EXPECT_EQ(desk.snapshot().change, LeaseChange::kExpired);
    EXPECT_FALSE(desk.renew(anna, granted.token));
  }
}

TEST_F(LeaseDeskTest, EachUseRenewsIt) {
  LeaseTerms terms;
  terms.ttl = seconds(600);
  const auto granted = desk.acquire(anna, terms);
  const auto remaining_s = [this] { return desk.snapshot().lease->remaining_s; };
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
  expect_renewed("a command", [&] { (void)desk.admit(anna, granted->token, LeaseRule::kRequired); });
  expect_renewed("any other call", [&] { desk.note_use(anna, granted->token); });
  expect_renewed("a renewal", [&] { (void)desk.renew(anna, granted->token); });
  const double before_s = remaining_s();
  EXPECT_TRUE(test::eventually([&] { return remaining_s() < before_s; }));
  desk.note_use(ben, granted->token);
  EXPECT_LT(remaining_s(), before_s) << "not those of others";
}

TEST_F(LeaseDeskTest, RampsTheForceOfRemoteHoldersByDefault) {
  const auto remote =
      test::value_of(desk.acquire(of("spiffe://lab/hapticd/operator/anna", ConnectionKind::kTls), {}));
  EXPECT_EQ(remote.lease.terms.on_expiry, LeaseExpiry::kRampToZero);
  EXPECT_EQ(test::value_of(desk.take(anna, {}, "why", {})).lease.terms.on_expiry, LeaseExpiry::kKeep);
}

TEST(LeaseNotice, InformsTheHolderBeforeItIsTaken) {
  Daemon daemon;
  LeaseDesk desk(daemon.effects(), milliseconds(200));
  LeaseTerms terms;
  terms.ttl = seconds(60);
  const auto granted = desk.acquire(of("user:anna"), terms);
  const std::uint64_t seen = desk.snapshot().version;
  std::thread taker([&] { EXPECT_TRUE(desk.take(of("user:ben"), {}, "why", {})); });
  const LeaseSnapshot announced = desk.await_change(seen, LeaseDesk::Clock::now() + seconds(60));
  EXPECT_EQ(announced.taker, "user:ben");
  EXPECT_EQ(announced.take_reason, "why");
  ASSERT_TRUE(announced.lease);
  EXPECT_EQ(announced.lease->holder, "user:anna") << "it holds it still";
  taker.join();
  EXPECT_EQ(desk.snapshot().lease->holder, "user:ben");
}

TEST(LeaseNotice, IsGivenUpWithTheCall) {
  Daemon daemon;
  LeaseDesk desk(daemon.effects(), seconds(60));
  LeaseTerms terms;
  terms.ttl = seconds(60);
  ASSERT_TRUE(desk.acquire(of("user:anna"), terms));
  Caller caller{.deadline = Caller::Clock::now() + milliseconds(50)};
  EXPECT_EQ(test::refusal_of(desk.take(of("user:ben"), {}, "why", caller)).kind,
            RefusalKind::kDeadlineExceeded);
  EXPECT_EQ(desk.snapshot().lease->holder, "user:anna");
  EXPECT_TRUE(desk.snapshot().taker.empty());
}

TEST(LeaseNotice, IsNotGivenToAHolderThatIsNotHeardOf) {
  Daemon daemon;
  LeaseDesk desk(daemon.effects(), seconds(600));
  LeaseTerms terms;
  terms.ttl = milliseconds(100);
  ASSERT_TRUE(desk.acquire(of("user:anna"), terms));
  ASSERT_TRUE(test::eventually([&] {
    const auto lease = desk.snapshot().lease;
    return !lease || lease->is_stale;  // a busy machine may look only when it has expired
  }));
  EXPECT_TRUE(desk.take(of("user:ben"), {}, "why", {}));
}

/// Effects of which one lasts until it is let go, once it is armed.
class SlowDaemon {
 public:
  enum class Effect { kNone, kPublish, kExpired, kLost };

  LeaseDesk::Effects effects() {
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

/// All that others ask of the desk; returns only if none of it waits.
void ask_everything(LeaseDesk& desk) {
  const Identity other = of("user:other");
  (void)desk.admit(other, "", LeaseRule::kWhenTaken);
  (void)desk.admit(other, "no token", LeaseRule::kRequired);
  desk.note_use(other, "no token");
  (void)desk.renew(other, "no token");
  desk.give_back(other, "no token");
  const LeaseSnapshot now = desk.snapshot();
  (void)desk.await_change(now.version - 1, LeaseDesk::Clock::now() + seconds(600));
  (void)desk.lost(now.number - 1);
  (void)desk.ended();
}

TEST(LeaseEffects, OneThatLastsHoldsUpNoOtherCall) {
  using Effect = SlowDaemon::Effect;
  for (const Effect slow : {Effect::kPublish, Effect::kExpired, Effect::kLost}) {
    SlowDaemon daemon;
    LeaseDesk desk(daemon.effects(), seconds(0));
    LeaseTerms terms;
    terms.ttl = slow == Effect::kExpired ? milliseconds(20) : milliseconds(600'000);
    if (slow != Effect::kPublish) daemon.arm(slow);  // no other effect follows from acquiring it
    ASSERT_TRUE(desk.acquire(of("user:anna"), terms));
    daemon.arm(slow);
    std::thread taker;  // an expiry is noticed by the desk's own thread
    if (slow != Effect::kExpired)
      taker = std::thread([&] { (void)desk.take(of("user:ben"), {}, "why", {}); });
    daemon.await_begin();
    ask_everything(desk);
    const auto acquired = desk.acquire(of("user:carla"), {});
    EXPECT_EQ(static_cast<bool>(acquired), slow == Effect::kExpired) << "of the two others one holds it";
    daemon.let_go();
    if (taker.joinable()) taker.join();
  }
}

TEST(LeaseEffects, TheForceComesFirst) {
  using Effect = SlowDaemon::Effect;
  SlowDaemon daemon;
  LeaseDesk desk(daemon.effects(), seconds(0));
  LeaseTerms terms;
  terms.ttl = milliseconds(20);
  ASSERT_TRUE(desk.acquire(of("user:anna"), terms));
  ASSERT_TRUE(test::eventually([&] { return daemon.order().size() >= 5; }));
  EXPECT_EQ(daemon.order(), (std::vector<Effect>{Effect::kPublish, Effect::kPublish, Effect::kPublish,
                                                 Effect::kExpired, Effect::kLost}));
}

TEST(LeaseEffects, AnEffectMayAskTheDesk) {
  LeaseDesk* asked = nullptr;
  std::atomic<int> answers{0};
  LeaseDesk::Effects effects;
  effects.lost = [&](std::uint64_t number, const hal::Error&) {
    if (asked->lost(number) && asked->snapshot().number > number) ++answers;
  };
  LeaseDesk desk(std::move(effects), seconds(0));
  asked = &desk;
  ASSERT_TRUE(desk.acquire(of("user:anna"), {}));
  ASSERT_TRUE(desk.take(of("user:ben"), {}, "why", {}));
  EXPECT_EQ(answers.load(), 1);
}

TEST(LeaseRace, OneOfManyGetsIt) {
  Daemon daemon;
  LeaseDesk desk(daemon.effects(), seconds(0));
  std::atomic<int> granted{0};
  std::vector<std::thread> clients;
  for (int i = 0; i < 8; ++i) {
    clients.emplace_back([&, i] {
      if (desk.acquire(of("user:" + std::to_string(i)), {})) ++granted;
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(granted.load(), 1);
}

}  // namespace
}  // namespace hapticd::server
