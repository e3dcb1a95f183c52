// The doctor on what is kept of the rig: where, how much, and why not.

#include "server/diagnosis/recording_findings.h"

#include <filesystem>
#include <fstream>

#include "server/recording/flight/flight_recorder.h"
#include "server/recording/recorder.h"
#include "tests/unit/recording/recording_fixture.h"

namespace hapticd::server {
namespace {

namespace fs = std::filesystem;

class RecordingFindings : public RecordingTest {
 protected:
  /// Findings of recordings and of incidents.
  Findings examined() {
    Recorder recorder(hub_, event_log_, sources_, config_);
    FlightRecorder flight(hub_, event_log_, sources_, config_);
    static_cast<void>(recorder.open());
    static_cast<void>(flight.open());
    return examine_recording(recorder, flight);
  }
};

TEST_F(RecordingFindings, SayWhereTheyAreKeptAndHowMuchIsThere) {
  const Findings findings = examined();
  ASSERT_EQ(findings.size(), 2U);
  EXPECT_EQ(findings[0].severity, FindingSeverity::kGood);
  EXPECT_NE(findings[0].text.find(config_.folder), std::string::npos) << findings[0].text;
  EXPECT_NE(findings[0].text.find("0.0 of 20000 MB"), std::string::npos) << findings[0].text;
  EXPECT_EQ(findings[1].severity, FindingSeverity::kGood);
  EXPECT_NE(findings[1].text.find("0.0 of 2000 MB"), std::string::npos) << findings[1].text;
}

TEST_F(RecordingFindings, WarnBeforeTheQuotaIsUsedUp) {
  const Findings empty = examined();
  ASSERT_EQ(empty[0].severity, FindingSeverity::kGood);
  config_.quota_mb = 1.0;
  const std::string folder = empty[0].text.substr(8, empty[0].text.find(':') - 8);
  std::ofstream(folder + "/20260101T000000Z_long.mcap") << std::string(950'000, 'x');
  const Findings findings = examined();
  EXPECT_EQ(findings[0].severity, FindingSeverity::kWarning) << findings[0].text;
  EXPECT_NE(findings[0].remedy.find("[recording] quota_mb"), std::string::npos) << findings[0].remedy;
  config_.when_full = WhenFull::kRemoveOldest;
  EXPECT_EQ(examined()[0].severity, FindingSeverity::kGood) << "they make room by themselves";
}

TEST_F(RecordingFindings, OffByConfigurationIsOnlyANote) {
  config_.folder.clear();
  for (const Finding& finding : examined()) {
    EXPECT_EQ(finding.severity, FindingSeverity::kNote) << finding.text;
    EXPECT_FALSE(finding.remedy.empty());
  }
}

TEST_F(RecordingFindings, AFolderThatCannotBeMadeIsAProblem) {
  std::ofstream(folder_.path("file")) << "in the way";
  config_.folder = folder_.path("file");
  for (const Finding& finding : examined()) {
    EXPECT_EQ(finding.severity, FindingSeverity::kProblem) << finding.text;
    EXPECT_NE(finding.text.find(config_.folder), std::string::npos) << finding.text;
  }
}

}  // namespace
}  // namespace hapticd::server
