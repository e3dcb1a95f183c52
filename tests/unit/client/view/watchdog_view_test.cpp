#include "client/cli/view/watchdog_view.h"

#include <gtest/gtest.h>

namespace hapticd::cli {
namespace {

TEST(WatchdogView, NamesWhoIsMissing) {
  v1::RigState state;
  v1::WatchdogEndpoint& pedal = *state.add_watchdog_endpoints();
  pedal.set_name("pedal");
  pedal.set_is_pedal(true);
  pedal.set_state(v1::ENDPOINT_STATE_ALIVE);
  v1::WatchdogEndpoint& other = *state.add_watchdog_endpoints();
  other.set_name("experiment");
  other.set_state(v1::ENDPOINT_STATE_ALIVE);
  EXPECT_EQ(watchdog_words(state.watchdog_endpoints()), "all 2 endpoints are alive");
  other.set_state(v1::ENDPOINT_STATE_MISSING);
  other.set_silent_ms(1234.0);
  EXPECT_EQ(watchdog_words(state.watchdog_endpoints()), "no force: experiment was not heard of for 1.2 s");
  pedal.set_state(v1::ENDPOINT_STATE_RELEASED);
  other.set_state(v1::ENDPOINT_STATE_AWAITED);
  EXPECT_EQ(watchdog_words(state.watchdog_endpoints()),
            "no force: pedal reports its pedal released, experiment has not checked in yet");
}

}  // namespace
}  // namespace hapticd::cli
