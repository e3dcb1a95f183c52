#include "server/connection/connection_table.h"

#include <gtest/gtest.h>

namespace hapticd::server {
namespace {

using namespace std::chrono_literals;

Identity named(const std::string& name, bool is_denied = false) {
  Identity who;
  who.name = name;
  who.is_denied = is_denied;
  return who;
}

TEST(ConnectionTable, KeepsWhoIsBehindAConnectionAsLongAsItIsOpen) {
  ConnectionTable table;
  const std::string anna = "unix-abstract:" + table.add(named("user:anna"));
  const ConnectionTable::Clock::time_point now{};
  for (int i = 0; i < 100'000; ++i) table.close(table.add(named("user:" + std::to_string(i))), now);
  ASSERT_TRUE(table.find(anna));
  EXPECT_EQ(table.find(anna)->name, "user:anna");
  EXPECT_FALSE(table.find("unix-abstract:another"));
  EXPECT_FALSE(table.find("ipv4:127.0.0.1:40712"));
}

TEST(ConnectionTable, KnowsAClosedOneForAWhile) {
  ConnectionTable table;
  const std::string name = table.add(named("user:anna"));
  const ConnectionTable::Clock::time_point now{};
  table.close(name, now);
  EXPECT_TRUE(table.find(name)) << "a call that came before may begin now";
  table.close(table.add(named("user:ben")), now + 11s);
  EXPECT_FALSE(table.find(name));
  EXPECT_TRUE(ConnectionTable::is_relayed("unix-abstract:" + name)) << "it is no call within the process";
  EXPECT_FALSE(ConnectionTable::is_relayed("inproc:1"));
}

TEST(ConnectionTable, GivesNamesThatNoOneKnowsBefore) {
  ConnectionTable table;
  ConnectionTable another;
  EXPECT_NE(table.add(named("user:anna")), another.add(named("user:anna")));
}

TEST(ConnectionTable, ShowsInTheNameWhoIsDenied) {
  ConnectionTable table;
  EXPECT_TRUE(ConnectionTable::is_denied("unix-abstract:" + table.add(named("user:ben", true))));
  EXPECT_FALSE(ConnectionTable::is_denied("unix-abstract:" + table.add(named("user:anna"))));
  EXPECT_FALSE(ConnectionTable::is_denied("")) << "within the process";
}

}  // namespace
}  // namespace hapticd::server
