#include "client/cli/identify/identify_upload.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <string>
#include <thread>

#include "client/cli/session/session.h"
#include "tests/support/value_of.h"
#include "tests/unit/client/identify/identify_fake_service.h"

namespace hapticd::cli {
namespace {

using test::IdentifyFakeService;
constexpr std::size_t kMebibyte = std::size_t{1} << 20;

client::Client connect(const IdentifyFakeService& fake) {
  return client::Client({.address = fake.address()});
}

std::string text_of(std::size_t bytes) {
  std::string text = "time_s,force_n,position_mm\n";
  while (text.size() < bytes) text += std::to_string(text.size()) + ",1,2\n";
  text.resize(bytes);
  return text;
}

v1::RecordingDescription description() {
  v1::RecordingDescription result;
  result.set_name("cycle.csv");
  (*result.mutable_columns())["force"].set_column("Fz");
  return result;
}

TEST(IdentifyUpload, AFileIsSentInPiecesWellBelowTheSizeOfAMessage) {
  static_assert(2 * client::RecordingUpload::kMaxPiece <= kMebibyte);
  const test::TemporaryFolder folder;
  for (const std::size_t bytes :
       {std::size_t{1}, kMebibyte - 1, kMebibyte, kMebibyte + 1, 5 * kMebibyte + 77}) {
    IdentifyFakeService fake({});
    client::Client client = connect(fake);
    const std::string text = text_of(bytes);
    std::uint64_t last_sent = 0;
    bool all_sent = false;
    const auto answer = upload_file(client, folder.write("cycle.csv", text), description(),
                                    {.on_progress = [&](const UploadState& state) {
                                      EXPECT_GE(state.sent_bytes, last_sent);
                                      EXPECT_EQ(state.total_bytes, bytes);
                                      last_sent = state.sent_bytes;
                                      all_sent = all_sent || state.sent_bytes == bytes;
                                    }});
    EXPECT_EQ(answer.recording(), "recording-3");
    EXPECT_TRUE(all_sent);
    EXPECT_TRUE(fake.uploaded() == text);
    const auto pieces = fake.pieces();
    for (const auto& piece : pieces) EXPECT_LE(piece.csv().size(), client::RecordingUpload::kMaxPiece);
    ASSERT_FALSE(pieces.empty());
    EXPECT_EQ(pieces[0].description().columns().at("force").column(), "Fz");
    for (std::size_t i = 1; i < pieces.size(); ++i) EXPECT_FALSE(pieces[i].has_description());
  }
}

TEST(IdentifyUpload, APipeIsSentToo) {
  const test::TemporaryFolder folder;
  const std::string pipe = folder.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const std::string text = text_of(2 * kMebibyte + 5);
  std::thread writer([&] { std::ofstream(pipe) << text; });
  IdentifyFakeService fake({});
  client::Client client = connect(fake);
  bool has_total = false;
  upload_file(client, pipe, description(), {.on_progress = [&](const UploadState& state) {
                has_total = has_total || state.total_bytes.has_value();
              }});
  writer.join();
  EXPECT_FALSE(has_total);
  EXPECT_TRUE(fake.uploaded() == text);
}

TEST(IdentifyUpload, ARefusalInTheMiddleIsReportedWithLineAndColumn) {
  v1::ErrorDetail detail;
  detail.set_what("not a number");
  detail.set_where("cycle.csv, line 4711, column 'force_n'");
  detail.set_value("'abc'");
  IdentifyFakeService fake(
      {.upload_refused_after = 2 * kMebibyte,
       .upload_refusal = IdentifyFakeService::refusal(grpc::StatusCode::INVALID_ARGUMENT, detail)});
  client::Client client = connect(fake);
  const test::TemporaryFolder folder;
  const client::Error error = test::thrown_by<client::Error>(
      [&] { upload_file(client, folder.write("cycle.csv", text_of(20 * kMebibyte)), description(), {}); });
  EXPECT_EQ(error.kind(), client::ErrorKind::kRefused);
  EXPECT_EQ(error.code(), "INVALID_ARGUMENT");
  EXPECT_EQ(error.detail().where(), "cycle.csv, line 4711, column 'force_n'");
  EXPECT_EQ(error.detail().value(), "'abc'");
  EXPECT_LT(fake.uploaded().size(), 20 * kMebibyte);
}

TEST(IdentifyUpload, ADaemonThatStopsReadingEndsTheUpload) {
  IdentifyFakeService fake({.upload_stalls_after = 1});
  client::Client client = connect(fake);
  const test::TemporaryFolder folder;
  const std::string path = folder.write("cycle.csv", text_of(20 * kMebibyte));
  const client::Error error = test::thrown_by<client::Error>(
      [&] { upload_file(client, path, description(), {.timeout = std::chrono::milliseconds(200)}); });
  EXPECT_EQ(error.kind(), client::ErrorKind::kTimedOut);
}

TEST(IdentifyUpload, TheUserCanEndIt) {
  IdentifyFakeService fake({.upload_stalls_after = 1});
  client::Client client = connect(fake);
  const test::TemporaryFolder folder;
  const std::string path = folder.write("cycle.csv", text_of(20 * kMebibyte));
  EXPECT_THROW(upload_file(client, path, description(), {.interrupted = [] { return true; }}), LocalError);
}

TEST(IdentifyUpload, AnUnreadableFileIsReportedBeforeAnythingIsSent) {
  IdentifyFakeService fake({});
  client::Client client = connect(fake);
  const test::TemporaryFolder folder;
  EXPECT_THROW(upload_file(client, folder.path("none.csv"), description(), {}), LocalError);
  EXPECT_THROW(upload_file(client, folder.path(), description(), {}), LocalError);
  EXPECT_THROW(upload_file(client, folder.write("empty.csv", ""), description(), {}), LocalError);
  EXPECT_EQ(fake.uploaded(), "");
}

}  // namespace
}  // namespace hapticd::cli
