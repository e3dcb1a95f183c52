#include "rt/contact/pull_monitor.h"

#include <gtest/gtest.h>

namespace hapticd::rt {
namespace {

TEST(PullMonitor, AForceThatReversesAtThePlaceOfTheLastPushIsAPull) {
  PullMonitor watch;
  watch.remember({0.0, 0.3, 0.8}, {1.0, 2.0, -3.0});
  EXPECT_TRUE(watch.is_pull({0.0, 0.0, -0.02}, {1.0, 2.0, -2.0}));
  EXPECT_TRUE(watch.is_pull({0.0, -1.0, 0.1}, {1.0, 2.0, -3.0}));
}

TEST(PullMonitor, APullLastsUntilTheTipIsFreeOrPushed) {
  PullMonitor watch;
  watch.remember({0.0, 0.0, 1.0}, {});
  EXPECT_TRUE(watch.is_pull({0.0, 0.0, -0.2}, {}));
  EXPECT_TRUE(watch.is_pull({0.0, 0.0, -0.2}, {0.0, 0.0, 40.0})) << "a wrong zero comes along";
  EXPECT_FALSE(watch.is_pull({0.0, 0.0, 0.2}, {0.0, 0.0, 40.0}));
  EXPECT_TRUE(watch.is_pull({0.0, 0.0, -0.2}, {}));
  watch.release();
  EXPECT_FALSE(watch.is_pull({0.0, 0.0, -0.2}, {0.0, 0.0, 40.0}));
}

TEST(PullMonitor, AnotherPushIsNone) {
  PullMonitor watch;
  EXPECT_FALSE(watch.is_pull({0.0, 0.0, -1.0}, {})) << "nothing was felt yet";
  watch.remember({0.0, 0.0, 1.0}, {});
  EXPECT_FALSE(watch.is_pull({0.9, 0.0, 0.1}, {})) << "the edge of an object turns the force";
  EXPECT_FALSE(watch.is_pull({0.0, 0.0, -1.0}, {0.0, 0.0, 5.0})) << "the other side of a gap";
  watch.reset();
  EXPECT_FALSE(watch.is_pull({0.0, 0.0, -1.0}, {}));
}

}  // namespace
}  // namespace hapticd::rt
