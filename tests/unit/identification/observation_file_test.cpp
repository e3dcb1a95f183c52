#include "server/identification/run/observation_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

namespace fs = std::filesystem;

std::size_t lines_of(const std::string& path) {
  std::ifstream file(path);
  std::size_t lines = 0;
  for (std::string line; std::getline(file, line);) ++lines;
  return lines;
}

TEST(ObservationFile, HoldsEveryRowAndNothingOfAnEarlierOne) {
  const hapticd::test::TemporaryFolder folder;
  const std::string path = folder.write("contact-1.csv", std::string(1'000'000, '\n'));
  auto file = hapticd::test::value_of(ObservationFile::create(path, false));
  constexpr int kRows = 2000;  // more than is written at once
  rt::Observation observation;
  for (int row = 1; row <= kRows; ++row) {
    observation.sample.time_ns = row * 1'000'000;
    file.add(observation);
  }
  EXPECT_TRUE(file.finish());
  EXPECT_EQ(lines_of(path), 1U + kRows);
}

TEST(ObservationFile, LeavesRoomOnItsDisk) {
  const hapticd::test::TemporaryFolder folder;
  constexpr double kMoreThanThereIsMb = 1e12;
  auto file = hapticd::test::value_of(
      ObservationFile::create(folder.path("contact-1.csv"), false, kMoreThanThereIsMb));
  file.add({});
  const auto kept = file.finish();
  ASSERT_FALSE(kept);
  EXPECT_NE(kept.error().what.find("the disk is nearly full"), std::string::npos);
  EXPECT_EQ(fs::file_size(folder.path("contact-1.csv")), 0U);
}

TEST(RecordingStore, LeavesRoomOnItsDisk) {
  RecordingStore recordings;
  constexpr double kMoreThanThereIsMb = 1e12;
  recordings.keep_free(kMoreThanThereIsMb);
  const auto upload = recordings.begin({.name = "presses.csv", .columns = {}}, 0.0);
  ASSERT_TRUE(upload);
  const auto refused = (*upload)->append("time_s,force_N,position_mm\n");
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, RefusalKind::kResourceExhausted);
  EXPECT_EQ(refused->error.what, "the recording cannot be kept: the disk is nearly full");
}

TEST(ObservationFile, IsWrittenThroughNoLinkAndIntoNoPipe) {
  const hapticd::test::TemporaryFolder folder;
  const std::string precious = folder.write("precious", "kept");
  fs::create_symlink(precious, folder.path("contact-1.csv"));
  EXPECT_FALSE(ObservationFile::create(folder.path("contact-1.csv"), false));
  EXPECT_EQ(fs::file_size(precious), 4U);
  ASSERT_EQ(mkfifo(folder.path("contact-2.csv").c_str(), 0600), 0);
  const auto refused = ObservationFile::create(folder.path("contact-2.csv"), false);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().limit, "a regular file");
}

}  // namespace
}  // namespace hapticd::server
