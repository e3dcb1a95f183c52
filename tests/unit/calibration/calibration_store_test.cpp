#include "server/calibration/store/calibration_store.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

StoredCalibration example(const std::string& rig = "sim:test") {
  StoredCalibration c;
  c.kind = calibration::CalibrationKind::kKinematics;
  c.created = "2026-01-02T03:04:05Z";
  c.rig = rig;
  c.fit.calibration.arm.first_link_mm = 215.25;
  c.fit.calibration.covariance.setIdentity();
  c.fit.latency_s = 0.0125;
  c.fit.parameters = {{"joint_1_gain", 1.01, 0.001, 1.0, "1"}};
  c.target_error = {{Eigen::Vector3d(1, 2, 3), Eigen::Matrix3d::Identity()}};
  return c;
}

void expect_refused_with(const hal::Result<StoredCalibration>& read, const std::string& value) {
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().value, value);
}

TEST(StoredCalibration, ReadsBackAsItWasWritten) {
  const std::string text = calibration_text(example());
  const auto read = test::value_of(read_calibration(text));
  EXPECT_EQ(calibration_text(read), text);
  EXPECT_EQ(read.hash.size(), 64U);
  EXPECT_DOUBLE_EQ(read.fit.calibration.arm.first_link_mm, 215.25);
  EXPECT_DOUBLE_EQ(read.fit.calibration.tracker_latency_s, 0.0125);
}

TEST(StoredCalibration, RefusesWhatIsNone) {
  EXPECT_FALSE(read_calibration("{}"));
  EXPECT_FALSE(read_calibration("no JSON"));
  std::string text = calibration_text(example());
  text.replace(text.find("215.25"), 6, "\"long\"");
  EXPECT_FALSE(read_calibration(text));
}

// A text is parsed before it is judged, so its size and its depth are limited.
TEST(StoredCalibration, RefusesWhatWouldTakeTooMuchToRead) {
  const std::string whole = calibration_text(example());
  const auto with_key = [&whole](const std::string& value) {
    return "{\"more\": " + value + "," + whole.substr(whole.find('{') + 1);
  };
  const auto list = [](std::size_t values) {
    std::string text = "[0";
    for (std::size_t i = 1; i < values; ++i) text += ",0";
    return text + "]";
  };
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_TRUE(read_calibration(with_key(list(10'000))));
  EXPECT_TRUE(read_calibration(with_key(nested(15))));
  expect_refused_with(read_calibration(with_key(list(20'000))), "more than 20000 values");
  expect_refused_with(read_calibration(with_key(nested(17))), "nested too deeply");
}

// A count that is written as a floating number may be larger than any integer: making one of it is undefined.
TEST(StoredCalibration, RefusesACountThatIsNoWholeNumber) {
  const std::string whole = calibration_text(example());
  ASSERT_TRUE(read_calibration(whole));
  for (const char* key : {"\"format\": ", "\"poses\": ", "\"outliers\": ", "\"use\": "}) {
    for (const char* number : {"118446744073709551616", "-1", "1.0", "1e300"}) {
      std::string text = whole;
      const std::size_t at = text.find(key);
      ASSERT_NE(at, std::string::npos) << key;
      const std::size_t from = at + std::string(key).size();
      text.replace(from, text.find_first_of(",\n", from) - from, number);
      EXPECT_FALSE(read_calibration(text)) << key << number;
    }
  }
}

TEST(CalibrationStore, WritesThroughNoLink) {
  const test::TemporaryFolder folder;
  const std::string precious = folder.write("precious", "kept");
  CalibrationStore store(folder.path(), "sim:test");
  const auto kept = test::value_of(store.keep(example()));
  std::filesystem::create_symlink(precious, folder.path("adopted.new"));
  EXPECT_FALSE(store.adopt(kept.hash));
  EXPECT_EQ(std::filesystem::file_size(precious), 4U);
  std::filesystem::remove(folder.path("adopted.new"));
  folder.write("adopted.new", std::string(1000, 'x'));  // of a crash
  ASSERT_TRUE(store.adopt(kept.hash));
  EXPECT_EQ(std::filesystem::file_size(folder.path("adopted")), kept.hash.size());
}

TEST(CalibrationStore, KeepsAdoptsAndDeletesOverARestart) {
  const test::TemporaryFolder folder;
  std::string hash;
  {
    CalibrationStore store(folder.path(), "sim:test");
    const auto kept = test::value_of(store.keep(example()));
    hash = kept.hash;
    EXPECT_EQ(store.adopted().get(), nullptr);
    ASSERT_TRUE(store.adopt(hash.substr(0, 8)));
    ASSERT_NE(store.adopted().get(), nullptr);
    EXPECT_EQ(store.adopted().get()->name, hash);
  }
  CalibrationStore store(folder.path(), "sim:test");
  EXPECT_EQ(store.adopted_hash(), hash);
  ASSERT_NE(store.adopted().get(), nullptr);
  EXPECT_EQ(test::error_of(store.remove(hash)).reason, Reason::kInUse);
  ASSERT_TRUE(store.adopt(""));
  EXPECT_EQ(store.adopted().get(), nullptr);
  EXPECT_FALSE(store.remove(hash));
  EXPECT_TRUE(store.list().empty());
  EXPECT_TRUE(CalibrationStore(folder.path(), "sim:test").list().empty());
}

TEST(CalibrationStore, DoesNotAdoptATipNorAnotherRigs) {
  CalibrationStore store("", "sim:test");
  StoredCalibration tip = example();
  tip.kind = calibration::CalibrationKind::kTip;
  const auto kept_tip = store.keep(tip);
  const auto kept_other = store.keep(example("sim:other"));
  ASSERT_TRUE(kept_tip && kept_other);
  EXPECT_FALSE(store.adopt(kept_tip->hash));
  EXPECT_FALSE(store.adopt(kept_other->hash));
  EXPECT_FALSE(store.adopt("abc"));
}

TEST(CalibrationStore, AFileThatIsTooLargeIsNotShown) {
  const test::TemporaryFolder folder;
  for (const std::size_t blanks : {std::size_t{500'000}, std::size_t{1'100'000}}) {
    const std::string text = calibration_text(example()) + std::string(blanks, ' ');
    folder.write(test::value_of(read_calibration(text)).hash + ".json", text);
  }
  EXPECT_EQ(CalibrationStore(folder.path(), "sim:test").list().size(), 1U);
}

TEST(CalibrationStore, AFileThatWasChangedIsNotShown) {
  const test::TemporaryFolder folder;
  std::string hash;
  {
    CalibrationStore store(folder.path(), "sim:test");
    hash = store.keep(example())->hash;
  }
  std::ofstream(std::filesystem::path(folder.path()) / (hash + ".json"), std::ios::app) << " ";
  EXPECT_TRUE(CalibrationStore(folder.path(), "sim:test").list().empty());
}

}  // namespace
}  // namespace hapticd::server
