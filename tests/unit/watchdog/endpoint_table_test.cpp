// Missing endpoints, in virtual time.

#include "server/watchdog/endpoint_table.h"

#include <gtest/gtest.h>

#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

using std::chrono::milliseconds;

class EndpointTableTest : public testing::Test {
 protected:
  CheckInRecord from(const std::string& endpoint, std::uint64_t nonce, std::uint64_t sender = 1,
                     std::optional<bool> pressed = {}) const {
    return {endpoint, sender, nonce, pressed, "user:anna"};
  }
  std::uint64_t begin(const std::string& endpoint, std::uint64_t sender = 1) {
    const auto answer = table.check_in(from(endpoint, 0, sender), now);
    EXPECT_TRUE(answer);
    EXPECT_FALSE(answer->counted);
    return answer->nonce;
  }
  std::uint64_t alive(const std::string& endpoint, std::uint64_t nonce, std::uint64_t sender = 1,
                      std::optional<bool> pressed = {}) {
    const auto answer = table.check_in(from(endpoint, nonce, sender, pressed), now);
    EXPECT_TRUE(answer) << answer.refusal().error.text();
    EXPECT_TRUE(answer->counted);
    return answer->nonce;
  }
  EndpointState state(std::size_t index) const { return table.views(now)[index].state; }

  std::uint64_t last_nonce = 100;
  EndpointTable table{{{{"experiment", 200.0, false}, {"pedal", 500.0, true}}},
                      [this] { return ++last_nonce; }};
  EndpointTable::Time now{std::chrono::hours(1)};
};

TEST_F(EndpointTableTest, AwaitsAllAtFirst) {
  EXPECT_FALSE(table.all_alive());
  EXPECT_FALSE(table.next_lapse());
  EXPECT_EQ(state(0), EndpointState::kAwaited);
  EXPECT_EQ(missing_words(table.views(now)),
            "endpoint 'experiment' has not checked in yet; endpoint 'pedal' has not checked in yet");
  EXPECT_TRUE(EndpointTable({}, [] { return 1U; }).all_alive());
}

TEST_F(EndpointTableTest, IsAliveOnlyWhileAllCheckIn) {
  std::uint64_t experiment = alive("experiment", begin("experiment"));
  EXPECT_FALSE(table.all_alive());
  alive("pedal", begin("pedal"), 1, true);
  EXPECT_TRUE(table.all_alive());
  now += milliseconds(199);
  EXPECT_TRUE(table.lapse(now).empty());
  experiment = alive("experiment", experiment);
  EXPECT_EQ(table.next_lapse(), now + milliseconds(200));
  now += milliseconds(200);
  EXPECT_EQ(table.lapse(now), std::vector<std::string>{"experiment"});
  EXPECT_TRUE(table.lapse(now).empty()) << "named once";
  EXPECT_FALSE(table.all_alive());
  EXPECT_EQ(state(0), EndpointState::kMissing);
  EXPECT_EQ(missing_words(table.views(now)), "endpoint 'experiment' was not heard of for 0.2 s");
  alive("experiment", experiment);
  EXPECT_TRUE(table.all_alive());
}

TEST_F(EndpointTableTest, ARepeatedMessageDoesNotCountAndHarmsNoOne) {
  const std::uint64_t first = begin("experiment");
  const std::uint64_t second = alive("experiment", first);
  now += milliseconds(150);
  for (const std::uint64_t stale : {first, second + 1, ~std::uint64_t{0}}) {
    const auto refused = test::refusal_of(table.check_in(from("experiment", stale), now));
    EXPECT_EQ(refused.kind, RefusalKind::kAborted);
  }
  EXPECT_EQ(table.views(now)[0].wrong_nonces, 3U);
  now += milliseconds(49);
  alive("experiment", second);
  now += milliseconds(199);
  EXPECT_TRUE(table.lapse(now).empty());
}

TEST_F(EndpointTableTest, BeginningAgainDoesNotCount) {
  alive("experiment", begin("experiment"));
  now += milliseconds(150);
  begin("experiment");
  now += milliseconds(50);
  EXPECT_EQ(table.lapse(now).size(), 1U);
}

TEST_F(EndpointTableTest, ASecondSenderIsRefusedUntilTheFirstIsMissing) {
  const std::uint64_t nonce = alive("experiment", begin("experiment"));
  EXPECT_EQ(test::refusal_of(table.check_in(from("experiment", 0, 2), now)).reason, Reason::kBusy);
  EXPECT_FALSE(table.check_in(from("experiment", nonce, 2), now)) << "nor with the nonce of the first";
  now += milliseconds(200);
  alive("experiment", begin("experiment", 2), 2);
  EXPECT_FALSE(table.check_in(from("experiment", nonce, 1), now));
}

TEST_F(EndpointTableTest, APedalMustSayWhetherItIsPressed) {
  const std::uint64_t nonce = begin("pedal");
  EXPECT_EQ(test::refusal_of(table.check_in(from("pedal", nonce), now)).kind, RefusalKind::kInvalidArgument);
  alive("pedal", nonce, 1, false);
  EXPECT_TRUE(table.any_released());
  EXPECT_EQ(state(1), EndpointState::kReleased);
  EXPECT_EQ(table.views(now)[1].config.name, "pedal");
}

TEST_F(EndpointTableTest, WhoWasAPedalOnceStaysOne) {
  const std::uint64_t nonce = alive("experiment", begin("experiment"), 1, true);
  EXPECT_FALSE(table.check_in(from("experiment", nonce), now));
  EXPECT_TRUE(table.views(now)[0].is_pedal);
}

TEST_F(EndpointTableTest, RefusesUnknownNamesAndMissingSenders) {
  const auto unknown = test::refusal_of(table.check_in(from("pedall", 0), now));
  EXPECT_EQ(unknown.kind, RefusalKind::kNotFound);
  EXPECT_EQ(unknown.error.remedy, "did you mean 'pedal'?");
  EXPECT_EQ(test::refusal_of(table.check_in(from("pedal", 0, 0), now)).kind, RefusalKind::kInvalidArgument);
  EndpointTable none({}, [] { return 1U; });
  EXPECT_EQ(none.check_in(from("pedal", 0), now).refusal().error.what, "this daemon has no watchdog");
}

}  // namespace
}  // namespace hapticd::server
