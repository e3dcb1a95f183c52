// Reasons arrive whatever text they quote.

#include <google/protobuf/any.pb.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <gtest/gtest.h>

#include <fstream>
#include <memory>

#include "hapticd/v1/identification.grpc.pb.h"
#include "server/text/utf8_text.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/robustness/raw_call.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

TEST(Utf8Text, IsRepairedByteByByte) {
  using server::repaired_utf8;
  const std::string bad = "\xef\xbf\xbd";
  EXPECT_EQ(repaired_utf8("plain, µN, 力, 🖐"), "plain, µN, 力, 🖐");
  EXPECT_EQ(repaired_utf8("Kr\xe4"
                          "ft"),
            "Kr" + bad + "ft");
  EXPECT_EQ(repaired_utf8("cut \xe5\x8a"), "cut " + bad + bad);
  EXPECT_EQ(repaired_utf8("\xc0\x80"), bad + bad) << "overlong";
  EXPECT_EQ(repaired_utf8("\xed\xa0\x80"), bad + bad + bad) << "a surrogate";
  EXPECT_EQ(repaired_utf8("\xf4\x90\x80\x80"), bad + bad + bad + bad) << "beyond Unicode";
  EXPECT_EQ(repaired_utf8("\xf5"), bad);
  EXPECT_EQ(repaired_utf8(""), "");
  EXPECT_TRUE(server::is_utf8("力"));
  EXPECT_FALSE(server::is_utf8("\xe5\x8a"));
}

TEST(Utf8Text, IsCutBetweenCharacters) {
  using server::shortened;
  EXPECT_EQ(shortened("short", 5), "short");
  EXPECT_EQ(shortened("longer", 5), "lo…");
  EXPECT_EQ(shortened("力力力力", 8), "力…") << "no half of a character";
  for (std::size_t bytes = 3; bytes < 30; ++bytes) {
    const std::string cut = shortened("ab力c🖐de力f🖐gh力i🖐jk", bytes);
    EXPECT_LE(cut.size(), bytes);
    EXPECT_TRUE(server::is_utf8(cut)) << bytes;
  }
}

/// Expects that the status arrives, not "received initial metadata size exceeds limit".
void expect_arrives(const grpc::Status& status, grpc::StatusCode code) {
  EXPECT_EQ(status.error_code(), code) << status.error_message().substr(0, 300);
  const v1::ErrorDetail detail = detail_of(status);
  EXPECT_FALSE(detail.what().empty());
  for (const std::string& part : {detail.what(), detail.where(), detail.value()}) {
    EXPECT_LE(part.size(), 200U);
    EXPECT_TRUE(server::is_utf8(part));
  }
}

TEST(ErrorText, ArrivesHoweverLongTheNamesItQuotes) {
  const RunningService service;
  for (const std::size_t bytes : {std::size_t{300}, std::size_t{3000}, std::size_t{15000}}) {
    for (const std::string& letter : {std::string("x"), std::string("力")}) {
      std::string name;
      while (name.size() < bytes) name += letter;
      SCOPED_TRACE(std::to_string(bytes) + " bytes of " + letter);
      expect_arrives(service.load(name), grpc::StatusCode::NOT_FOUND);
      expect_arrives(service.load_toml("name = \"x\"\n\"" + name.substr(0, 15000) + "\" = 1\n"),
                     grpc::StatusCode::INVALID_ARGUMENT);
      expect_arrives(service.load_toml("name = \"x\"\nkind = \"" + name.substr(0, 15000) + "\"\n"),
                     grpc::StatusCode::INVALID_ARGUMENT);
      v1::SetObjectRequest object;
      object.set_name(name);
      v1::SetObjectResponse moved;
      const grpc::Status status = service.simulation->SetObject(call_context().get(), object, &moved);
      EXPECT_FALSE(status.ok());
      expect_arrives(status, status.error_code());
    }
  }
}

/// What a client sees whose language brings no google.rpc.Status.
TEST(ErrorText, IsReadWithTheEnvelopeThatIsShippedBesideTheContract) {
  const RunningService service;
  const grpc::Status refused = service.load("tap_2d");
  ASSERT_FALSE(refused.ok());
  google::protobuf::FileDescriptorSet files;
  std::ifstream stream(RPC_STATUS_DESCRIPTORS, std::ios::binary);
  ASSERT_TRUE(files.ParseFromIstream(&stream));
  google::protobuf::DescriptorPool pool;
  for (const auto& one : files.file()) ASSERT_NE(pool.BuildFile(one), nullptr) << one.name();
  google::protobuf::DynamicMessageFactory factory(&pool);
  const auto* type = pool.FindMessageTypeByName("google.rpc.Status");
  ASSERT_NE(type, nullptr);
  const std::unique_ptr<google::protobuf::Message> envelope(factory.GetPrototype(type)->New());
  ASSERT_TRUE(envelope->ParseFromString(refused.error_details()));
  const auto& access = *envelope->GetReflection();
  EXPECT_EQ(access.GetInt32(*envelope, type->FindFieldByName("code")), refused.error_code());
  EXPECT_EQ(access.GetString(*envelope, type->FindFieldByName("message")), refused.error_message());
  ASSERT_EQ(access.FieldSize(*envelope, type->FindFieldByName("details")), 1);
  google::protobuf::Any any;
  ASSERT_TRUE(any.ParseFromString(
      access.GetRepeatedMessage(*envelope, type->FindFieldByName("details"), 0).SerializeAsString()));
  v1::ErrorDetail detail;
  ASSERT_TRUE(any.UnpackTo(&detail)) << any.type_url();
  EXPECT_NE(detail.remedy().find("tap_1d"), std::string::npos) << detail.remedy();
}

/// gRPC's own answer is INTERNAL without a word.
TEST(ErrorText, OfARequestThatIsNoMessageNamesTheMethod) {
  const RunningService service;
  const std::string latin = "\x0a\x04\xfc\x62\x65\x72";  // field 1, a text that is not UTF-8
  const std::string cut = "\x0a\x7f";                    // field 1, of 127 bytes that are not there
  // The last three are of the callback interface, where gRPC's answer is UNIMPLEMENTED.
  for (const char* method : {"SceneService/LoadScene", "SceneService/ExplainScene",
                             "SimulationService/SetObject", "IdentificationService/WatchIdentification",
                             "WatchdogService/CheckIn", "ClockService/Exchange", "SafetyService/Clear"}) {
    SCOPED_TRACE(method);
    std::string where = method;
    where[where.find('/')] = '.';
    const bool has_text =
        !std::string(method).starts_with("Clock") && !std::string(method).starts_with("Safety");
    for (const std::string& bytes : {latin, cut}) {
      if (bytes == latin && !has_text) continue;
      const RawAnswer answer = raw_call(service.channel, std::string("/hapticd.v1.") + method, bytes);
      expect_arrives(answer.status, grpc::StatusCode::INVALID_ARGUMENT);
      EXPECT_EQ(detail_of(answer.status).what(), "the request cannot be read");
      EXPECT_EQ(detail_of(answer.status).where(), where);
      EXPECT_FALSE(detail_of(answer.status).remedy().empty());
    }
  }
}

TEST(ErrorText, OfARecordingThatIsNotUtf8Arrives) {
  const RunningService service;
  const auto stub = v1::IdentificationService::NewStub(service.channel);
  const auto context = call_context();
  v1::UploadRecordingResponse response;
  const auto writer = stub->UploadRecording(context.get(), &response);
  v1::UploadRecordingRequest piece;
  piece.mutable_description()->set_name("presses.csv");
  piece.set_csv(
      "Zeit_s,Kr\xe4"
      "ft_\xb5N,Weg_mm\n0,1,2\n1,1,2\n");
  ASSERT_TRUE(writer->Write(piece));
  writer->WritesDone();
  ASSERT_TRUE(ok(writer->Finish()));
  EXPECT_FALSE(response.recording().empty());
  ASSERT_GT(response.remarks_size(), 0) << "it lacks the columns that are needed";
  EXPECT_NE(response.remarks(0).find("not readable as it is"), std::string::npos);
  for (const std::string& remark : response.remarks()) EXPECT_TRUE(server::is_utf8(remark));
}

}  // namespace
}  // namespace hapticd::test
