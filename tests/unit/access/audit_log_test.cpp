#include "server/access/audit_log.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/eventually.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace {
std::atomic<bool> disk_stands_still{false};
}  // namespace

/// Waits while the disk takes nothing.
extern "C" ssize_t pwrite(int file, const void* bytes, size_t size, off_t at) {
  while (disk_stands_still) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  static const auto of_the_system = reinterpret_cast<decltype(&pwrite)>(dlsym(RTLD_NEXT, "pwrite"));
  return of_the_system(file, bytes, size, at);
}

namespace hapticd::server {
namespace {

AuditLine a_line(const std::string& method) {
  AuditLine line;
  line.unix_ns = 1'700'000'000'123'456'789;
  line.tick = 42;
  line.identity = "user:anna";
  line.role = "operator";
  line.peer = "ipv4:127.0.0.1:40712";
  line.lease = 3;
  line.method = method;
  line.arguments = "stiffness_n_per_mm: 0.3";
  line.outcome = "OK";
  line.effective_tick = 43;
  return line;
}

std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

TEST(AuditLine, IsOneLineOfJson) {
  EXPECT_EQ(to_json(a_line("RenderingService/SetTarget")),
            R"({"time":"2023-11-14T22:13:20.123456Z","tick":42,"identity":"user:anna","role":"operator",)"
            R"("peer":"ipv4:127.0.0.1:40712","method":"RenderingService/SetTarget","outcome":"OK","lease":3,)"
            R"("arguments":"stiffness_n_per_mm: 0.3","effective_tick":43})");
}

TEST(AuditLine, StaysOneLineWhateverAClientSends) {
  AuditLine line = a_line("x");
  line.arguments = "a\nb\"\x01\xff";
  const std::string json = to_json(line);
  EXPECT_EQ(json.find('\n'), std::string::npos);
  EXPECT_NE(json.find(R"(a\nb\"\u0001)"), std::string::npos) << json;
}

TEST(AuditLog, KeepsEveryLineUpToItsLimitAndRotates) {
  const test::TemporaryFolder folder;
  AccessConfig config;
  config.audit_file = folder.path("audit.jsonl");
  config.audit_file_mb = 0.1;
  constexpr int kLines = 2000;
  {
    auto log = test::value_of(AuditLog::open(config));
    for (int i = 0; i < kLines; ++i) log->write(a_line("number " + std::to_string(i)));
    EXPECT_EQ(log->dropped(), 0U);
  }
  std::size_t kept = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder.path())) {
    EXPECT_LE(file.file_size(), 100'000U) << file.path();
    kept += lines_of(file.path()).size();
  }
  EXPECT_EQ(kept, static_cast<std::size_t>(kLines)) << "0.5 MB in five files";
  const auto newest = lines_of(config.audit_file);
  ASSERT_FALSE(newest.empty());
  EXPECT_NE(newest.back().find("number 1999"), std::string::npos);
}

// As on a disk that is full for a time: a file that may not grow ends with a part of a line.
TEST(AuditLog, CountsLinesThatFindNoRoomAndLeavesNoPartOfThem) {
  const test::TemporaryFolder folder;
  AccessConfig config;
  config.audit_file = folder.path("audit.jsonl");
  constexpr std::size_t kLines = 10;
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, SIG_IGN);
  {
    auto log = test::value_of(AuditLog::open(config));
    const rlimit little{.rlim_cur = 1000, .rlim_max = before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &little);
    for (std::size_t i = 0; i < kLines; ++i) log->write(a_line("without room"));
    EXPECT_TRUE(test::eventually([&] { return log->dropped() > 0; }));
    setrlimit(RLIMIT_FSIZE, &before);
    log->write(a_line("with room again"));
  }
  std::size_t counted = 0;
  std::string last;
  for (const std::string& line : lines_of(config.audit_file)) {
    const auto json = nlohmann::json::parse(line);
    counted += json.value("dropped", std::size_t{1});
    last = json.value("method", last);
  }
  EXPECT_EQ(counted, kLines + 1);
  EXPECT_EQ(last, "with room again");
}

TEST(AuditLog, RefusalsOfOneRotateNoLineOfTheOthersAway) {
  const test::TemporaryFolder folder;
  AccessConfig config;
  config.audit_file = folder.path("audit.jsonl");
  config.audit_file_mb = 0.1;
  constexpr std::size_t kRefused = 20'000;  // with 0.5 MB in five files some 2000 lines are kept
  {
    auto log = test::value_of(AuditLog::open(config));
    log->write(a_line("of anna"));
    AuditLine refused = a_line("refused");
    refused.identity = "user:mallory";
    refused.outcome = "PERMISSION_DENIED";
    refused.lease = 0;
    for (std::size_t i = 0; i < kRefused; ++i) log->write(refused);
    AuditLine granted = refused;
    granted.lease = 4;
    granted.outcome = "CANCELLED";  // it may have acted before
    granted.method = "granted";
    log->write(granted);
    log->write(a_line("of anna again"));
  }
  const auto lines = lines_of(config.audit_file);
  ASSERT_GE(lines.size(), 3U + AuditLog::kRefusalsPerS);
  EXPECT_NE(lines.front().find("of anna"), std::string::npos);
  EXPECT_NE(lines.back().find("of anna again"), std::string::npos);
  EXPECT_NE(lines[lines.size() - 2].find(R"("method":"granted")"), std::string::npos)
      << "what changes a state is always written";
  std::size_t refused = 0;
  for (const std::string& line : lines) {
    const auto json = nlohmann::json::parse(line);
    refused += json["outcome"] == "PERMISSION_DENIED" ? 1 : 0;
    refused += json.value("refusals_not_written", std::size_t{0});
  }
  EXPECT_EQ(refused, kRefused) << "each is written or counted";
}

TEST(AuditLog, DropsAndCountsWhatADiskIsTooSlowFor) {
  const test::TemporaryFolder folder;
  AccessConfig config;
  config.audit_file = folder.path("audit.jsonl");
  constexpr std::size_t kLines = 4 * AuditLog::kMaxQueue;
  auto log = test::value_of(AuditLog::open(config));
  disk_stands_still = true;
  for (std::size_t i = 0; i < kLines; ++i) log->write(a_line("x"));
  EXPECT_GT(log->dropped(), 0U) << "write() came back each time";
  disk_stands_still = false;
  log.reset();
  std::size_t counted = 0;
  for (const std::string& line : lines_of(config.audit_file)) {
    counted += nlohmann::json::parse(line).value("dropped", std::size_t{1});
  }
  EXPECT_EQ(counted, kLines);
}

TEST(AuditLog, GoesOnInAnotherFileOnceItsOwnWasMovedOrEmptied) {
  const test::TemporaryFolder folder;
  AccessConfig config;
  config.audit_file = folder.path("audit.jsonl");
  auto log = test::value_of(AuditLog::open(config));
  const auto count_after = [&](const std::string& method) {
    log->write(a_line(method));
    EXPECT_TRUE(test::eventually([&] {
      const auto lines = lines_of(config.audit_file);
      return !lines.empty() && lines.back().find(method) != std::string::npos;
    }));
    return lines_of(config.audit_file).size();
  };
  EXPECT_EQ(count_after("first"), 1U);
  EXPECT_EQ(count_after("second"), 2U);
  std::filesystem::rename(config.audit_file, folder.path("moved.jsonl"));
  EXPECT_EQ(count_after("third"), 1U);
  EXPECT_EQ(lines_of(folder.path("moved.jsonl")).size(), 2U);
  std::filesystem::resize_file(config.audit_file, 0);
  EXPECT_EQ(count_after("fourth"), 1U);
}

TEST(AuditLog, RefusesWhatIsSomethingElse) {
  const test::TemporaryFolder folder;
  AccessConfig config;
  const auto is_refused = [&](const std::string& path) {
    config.audit_file = path;
    const auto log = AuditLog::open(config);
    return !log && log.error().where == "[access] audit_file" && AuditLog::check(path);
  };
  const std::string pipe = folder.path("pipe");  // without a reader
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_TRUE(is_refused(pipe));
  EXPECT_TRUE(is_refused(folder.path()));
  EXPECT_TRUE(is_refused("/dev/full"));
  const std::string store = folder.path("models.sqlite");
  std::ofstream(store) << "SQLite format 3";
  EXPECT_TRUE(is_refused(store));
  EXPECT_EQ(std::filesystem::file_size(store), 15U);
  config.audit_file = "/proc/no/such/folder/audit.jsonl";  // cannot be written
  EXPECT_EQ(test::error_of(AuditLog::open(config)).where, "[access] audit_file");
}

TEST(AuditLog, IsOfOneDaemon) {
  const test::TemporaryFolder folder;
  AccessConfig config;
  config.audit_file = folder.path("audit.jsonl");
  auto first = test::value_of(AuditLog::open(config));
  const auto second = AuditLog::open(config);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().text().find("another process writes"), std::string::npos) << second.error().text();
  first.reset();
  EXPECT_TRUE(AuditLog::open(config));
}

}  // namespace
}  // namespace hapticd::server
