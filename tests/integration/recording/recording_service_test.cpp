// Recordings and incidents, over the network.

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "client/cpp/client.h"
#include "hal/recording/recording_names.h"
#include "hapticd/v1/identification.grpc.pb.h"
#include "hapticd/v1/recording.grpc.pb.h"
#include "tests/integration/access/access_client.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/recording/seen_recording.h"
#include "tests/integration/running_service.h"
#include "tests/support/eventually.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using recording::EventKind;

class RecordingServiceTest : public testing::Test {
 protected:
  server::DaemonConfig config() const { return config_that_records(folder_.path("state")); }
  static client::Client client_of(const RunningService& service) {
    return client::Client({.address = service.address(), .timeout = std::chrono::milliseconds(kTimeout)});
  }
  /// The pieces of a stream, put together.
  static std::string fetched(client::RecordingStream stream) {
    std::string all;
    v1::RecordingPiece piece;
    for (;;) {
      const auto event = stream.next(piece, std::chrono::milliseconds(kTimeout));
      if (event == client::RecordingStream::Event::kEnded) return all;
      if (event == client::RecordingStream::Event::kNothing) throw std::runtime_error("nothing came");
      if (all.empty() && piece.total_bytes() == 0) throw std::runtime_error("the size is not there");
      all += piece.data();
    }
  }
  std::string fetched_file(client::Client& client, const std::string& id) const {
    v1::GetRecordingRequest request;
    request.set_id(id);
    request.set_kind(v1::RECORDING_KIND_RECORDING);
    return folder_.write(id + ".mcap", fetched(client.get_recording(request)));
  }
  static v1::ExportRecordingRequest export_of(const std::string& id, v1::ExportFormat format) {
    v1::ExportRecordingRequest request;
    request.set_id(id);
    request.set_format(format);
    return request;
  }

  const TemporaryFolder folder_;
};

TEST_F(RecordingServiceTest, APressIsRecordedWithAllThatHappened) {
  const RunningService service(config());
  client::Client client = client_of(service);
  v1::StartRecordingRequest start;
  start.set_name("press");
  start.set_note("a sponge");
  const v1::RecordingFile running = client.start_recording(start);
  EXPECT_EQ(running.state(), v1::RECORDING_STATE_RUNNING);
  client.load_scene({.name = "tap_1d"});
  v1::SetTargetRequest target;
  target.set_stiffness_n_per_mm(0.3);
  client.set_target(target);
  service.press(3.0, [](const v1::RigState& state) { return state.hand_force_n() > 2.0; });
  client.annotate_recording("now it is pressed");
  client.stop("enough");
  service.await(is_latched);
  EXPECT_EQ(client.rig_state().recording(), running.id());
  EXPECT_EQ(client.rig_state().telemetry_subscribers(), 0U) << "those of the daemon itself do not count";
  const v1::RecordingFile file = client.stop_recording();
  EXPECT_EQ(file.lost_ticks(), 0U);
  EXPECT_EQ(file.id(), running.id());

  const auto list = client.recordings(v1::RECORDING_KIND_RECORDING);
  ASSERT_EQ(list.recordings_size(), 1);
  EXPECT_EQ(list.recordings(0).note(), "a sponge");
  EXPECT_EQ(list.recordings(0).rows(), file.rows());
  EXPECT_EQ(list.recordings(0).state(), v1::RECORDING_STATE_FINISHED);

  const SeenRecording seen = seen_of(fetched_file(client, file.id()));
  EXPECT_TRUE(seen.is_finished);
  EXPECT_EQ(seen.ticks.size(), file.rows());
  EXPECT_EQ(seen.missing_ticks(), 0);
  EXPECT_GT(seen.greatest_force_n, 0.2);
  EXPECT_TRUE(seen.has_event(EventKind::kScene, "load scene"));
  EXPECT_TRUE(seen.has_event(EventKind::kTarget, "in force from tick"));
  EXPECT_TRUE(seen.has_event(EventKind::kAnnotation, "now it is pressed"));
  EXPECT_TRUE(seen.has_event(EventKind::kStop, "stopped: zero force"));
  EXPECT_TRUE(seen.has_event(EventKind::kStop, "enough"));
  EXPECT_EQ(seen.metadata.at(recording::kSceneMetadata).at("name"), "tap_1d");
  EXPECT_NE(seen.metadata.at(recording::kConfigurationMetadata).at("toml").find("[guard]"),
            std::string::npos);

  v1::DeleteRecordingRequest remove;
  remove.set_id(file.id());
  client.delete_recording(remove);
  EXPECT_EQ(client.recordings(v1::RECORDING_KIND_RECORDING).recordings_size(), 0);
}

TEST_F(RecordingServiceTest, ARecordingEndsWithItsLeaseWhereThatWasAskedFor) {
  const RunningService service(config());
  client::Client client = client_of(service);
  AccessClient holder(connect(service.address()));
  const auto recordings = v1::RecordingService::NewStub(connect(service.address()));
  v1::StartRecordingRequest start;
  start.set_until_lease_ends(true);
  v1::RecordingFile file;
  const grpc::Status refused = recordings->StartRecording(call_context().get(), start, &file);
  EXPECT_EQ(detail_of(refused).reason(), v1::ERROR_REASON_LEASE_REQUIRED);
  ASSERT_TRUE(holder.acquire().ok());
  ASSERT_TRUE(recordings->StartRecording(holder.context().get(), start, &file).ok());
  ASSERT_TRUE(holder.give_back().ok());
  v1::RecordingFile ended;
  EXPECT_TRUE(eventually([&] {
    ended = client.recordings(v1::RECORDING_KIND_RECORDING).recordings(0);
    return ended.state() == v1::RECORDING_STATE_FINISHED;
  }));
  EXPECT_NE(ended.end_reason().find("the lease was returned"), std::string::npos) << ended.end_reason();
  start.set_until_lease_ends(false);
  EXPECT_TRUE(recordings->StartRecording(call_context().get(), start, &file).ok()) << "another can begin";
}

TEST_F(RecordingServiceTest, TheFileDescribesItselfToAReaderWithoutTheContract) {
  const RunningService service(config());
  client::Client client = client_of(service);
  client.start_recording({});
  service.await([](const v1::RigState& state) { return state.tick() > 200; });
  const std::string path = fetched_file(client, client.stop_recording().id());

  const auto reader = value_of(recording::McapReader::open(path));
  google::protobuf::DescriptorPool pool;
  google::protobuf::DynamicMessageFactory factory(&pool);
  std::map<std::string, int> seen;
  std::map<std::uint16_t, std::string> schemas;
  std::map<std::uint16_t, std::uint16_t> channels;
  recording::McapVisitor visitor;
  visitor.schema = [&](const recording::Schema& schema) {
    EXPECT_EQ(schema.encoding, "protobuf");
    google::protobuf::FileDescriptorSet set;
    ASSERT_TRUE(set.ParseFromString(schema.data));
    for (const auto& file : set.file()) {
      if (pool.FindFileByName(file.name()) != nullptr) continue;
      ASSERT_NE(pool.BuildFile(file), nullptr) << file.name();
    }
    schemas[schema.id] = schema.name;
  };
  visitor.channel = [&](const recording::Channel& channel) { channels[channel.id] = channel.schema_id; };
  visitor.message = [&](const recording::Message& message) {
    const std::string& name = schemas.at(channels.at(message.channel_id));
    const auto* type = pool.FindMessageTypeByName(name);
    EXPECT_NE(type, nullptr) << name;
    const std::unique_ptr<google::protobuf::Message> content(factory.GetPrototype(type)->New());
    EXPECT_TRUE(content->ParseFromString(std::string(message.data)));
    EXPECT_TRUE(content->GetReflection()->GetUnknownFields(*content).empty());
    // What our own hand wrote is what the contract's code reads.
    if (name == recording::kBlockSchema && seen[name] == 0) {
      v1::TelemetryBlock block;
      EXPECT_TRUE(block.ParseFromString(std::string(message.data)));
      EXPECT_EQ(block.columns(0).name(), "tick");
      EXPECT_EQ(block.columns(0).type(), v1::COLUMN_TYPE_INT64);
      EXPECT_EQ(block.columns(3).unit(), "mm");
      EXPECT_EQ(block.rows().size() % (8 * static_cast<std::size_t>(block.columns_size())), 0U);
    }
    if (name == recording::kEventSchema) {
      v1::RecordingEvent event;
      EXPECT_TRUE(event.ParseFromString(std::string(message.data)));
      EXPECT_NE(event.kind(), v1::RECORDING_EVENT_KIND_UNSPECIFIED);
    }
    ++seen[name];
    return true;
  };
  ASSERT_TRUE(reader.read(visitor));
  EXPECT_GT(seen[recording::kBlockSchema], 0);
  EXPECT_GT(seen[recording::kEventSchema], 0);
}

TEST_F(RecordingServiceTest, ExportsAreMadeAndRefused) {
  const RunningService service(config());
  client::Client client = client_of(service);
  client.start_recording({});
  service.await([](const v1::RigState& state) { return state.tick() > 2000; });
  const std::string id = client.stop_recording().id();
  const std::string hdf5 = fetched(client.export_recording(export_of(id, v1::EXPORT_FORMAT_HDF5)));
  EXPECT_TRUE(hdf5.starts_with("\x89HDF"));
  v1::ExportRecordingRequest csv = export_of(id, v1::EXPORT_FORMAT_CSV);
  csv.add_columns("guard_device_command_z_n");
  EXPECT_NE(fetched(client.export_recording(csv)).find("\ntick,time_s,guard_device_command_z_n\n"),
            std::string::npos);

  const auto stub = v1::RecordingService::NewStub(service.channel);
  const auto refused = [&](const v1::ExportRecordingRequest& request) {
    const auto context = call_context();
    const auto reader = stub->ExportRecording(context.get(), request);
    v1::RecordingPiece piece;
    EXPECT_FALSE(reader->Read(&piece));
    return reader->Finish();
  };
  csv.add_columns("guard_device_comand_z_n");
  expect_refused(refused(csv), grpc::StatusCode::INVALID_ARGUMENT, "recording '" + id + "'");
  EXPECT_EQ(refused(export_of("nothing", v1::EXPORT_FORMAT_CSV)).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(refused(export_of(id, v1::EXPORT_FORMAT_UNSPECIFIED)).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);

  v1::ExportRecordingRequest many = export_of(id, v1::EXPORT_FORMAT_CSV);
  for (int i = 0; i < 2000; ++i) many.add_columns("column_" + std::to_string(i));
  EXPECT_EQ(detail_of(refused(many)).limit(), "at most 1000");

  // One that was cut.
  const fs::path recordings = config().recording.folder + "/recordings";
  fs::copy_file(recordings / (id + ".mcap"), recordings / "cut.mcap");
  fs::resize_file(recordings / "cut.mcap", fs::file_size(recordings / "cut.mcap") * 2 / 3);
  EXPECT_TRUE(
      fetched(client.export_recording(export_of("cut", v1::EXPORT_FORMAT_HDF5))).starts_with("\x89HDF"))
      << "up to its last whole chunk";
  std::size_t left = 0;
  for (const auto& entry : fs::directory_iterator(config().recording.folder)) {
    if (entry.path().extension() == ".part") ++left;
  }
  EXPECT_EQ(left, 0U) << "files of exports stay behind";
}

TEST_F(RecordingServiceTest, NoLinkLeadsOutOfItsFolder) {
  const RunningService service(config());
  client::Client client = client_of(service);
  const fs::path recordings = config().recording.folder + "/recordings";
  fs::create_symlink(folder_.write("secret", "not for observers"), recordings / "link.mcap");
  EXPECT_TRUE(client.recordings(v1::RECORDING_KIND_RECORDING).recordings().empty());
  v1::GetRecordingRequest request;
  request.set_id("link");
  EXPECT_THROW(fetched(client.get_recording(request)), client::Error);
  EXPECT_THROW(fetched(client.export_recording(export_of("link", v1::EXPORT_FORMAT_CSV))), client::Error);
}

TEST_F(RecordingServiceTest, AnExportLeavesTheDiskItsRoom) {
  server::DaemonConfig full = config();
  const RunningService first(full);
  std::string id;
  {
    client::Client client = client_of(first);
    client.start_recording({});
    first.await([](const v1::RigState& state) { return state.tick() > 200; });
    id = client.stop_recording().id();
  }
  full.recording.folder = folder_.path("full");
  full.recording.keep_free_mb = 1e9;
  fs::create_directories(full.recording.folder + "/recordings");
  fs::copy(config().recording.folder + "/recordings", full.recording.folder + "/recordings");
  const RunningService second(full);
  const auto stub = v1::RecordingService::NewStub(second.channel);
  const auto context = call_context();
  const auto reader = stub->ExportRecording(context.get(), export_of(id, v1::EXPORT_FORMAT_CSV));
  v1::RecordingPiece piece;
  EXPECT_FALSE(reader->Read(&piece));
  expect_refused(reader->Finish(), grpc::StatusCode::RESOURCE_EXHAUSTED, v1::ERROR_REASON_DISK_FULL,
                 "export");
}

TEST_F(RecordingServiceTest, WithoutAFolderThatCanBeWrittenAllIsRefusedAndTheRigRuns) {
  const std::string file = folder_.write("file", "");
  for (const auto& [folder, where] : {std::pair(std::string(), std::string("[recording] folder")),
                                      {file + "/below", file + "/below/recordings"}}) {
    server::DaemonConfig without = config();
    without.recording.folder = folder;
    without.log_level = server::LogLevel::kOff;
    const RunningService service(without);
    const auto stub = v1::RecordingService::NewStub(service.channel);
    v1::RecordingFile recording;
    EXPECT_EQ(detail_of(stub->StartRecording(call_context().get(), {}, &recording)).where(), where);
    v1::MakeIncidentResponse made;
    EXPECT_EQ(stub->MakeIncident(call_context().get(), {}, &made).error_code(),
              grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_FALSE(service.state().flight_recorder_on());
    EXPECT_TRUE(service.load("tap_1d").ok());
  }
}

/// A press of some seconds, recorded; its path. `decimation`: one row for so many ticks.
std::string recorded_press(const server::DaemonConfig& config, std::uint32_t decimation = 1) {
  const RunningService service(config);
  client::Client client({.address = service.address(), .timeout = std::chrono::milliseconds(kTimeout)});
  client.load_scene({.name = "tap_1d"});
  service.await([](const v1::RigState& state) { return state.tick() > 300; });
  v1::StartRecordingRequest start;
  start.set_decimation(decimation);
  client.start_recording(start);
  service.press(3.0, [](const v1::RigState& state) { return state.hand_force_n() > 2.5; });
  const std::string id = client.stop_recording().id();
  return config.recording.folder + "/recordings/" + id + ".mcap";
}

TEST_F(RecordingServiceTest, ARecordingIsARig) {
  // The simulated world goes on while a busy machine leaves out ticks, and a step of more than five rows is a
  // silence of the sensor when it is replayed: rows are so far apart that no such pause is one.
  constexpr std::uint32_t kDecimation = 25;
  const std::string path = recorded_press(config(), kDecimation);
  const RunningService service(config_that_replays(path));
  ASSERT_TRUE(service.load("tap_1d").ok());
  const v1::RigState pressed = service.await(
      [](const v1::RigState& state) { return state.in_contact() && state.reaction_force_n() > 0.6; });
  EXPECT_GT(pressed.displacement_mm(), 0.5) << "the position is into the object";
}

TEST_F(RecordingServiceTest, ARecordingIsAnInputOfIdentification) {
  const std::string path = recorded_press(config());
  const std::string bytes = file_text(path);
  const RunningService service;
  client::Client client = client_of(service);
  v1::RecordingDescription description;
  description.set_name("press.mcap");
  client::RecordingUpload upload = client.upload_recording(description);
  for (std::size_t at = 0; at < bytes.size(); at += client::RecordingUpload::kMaxPiece) {
    upload.send(bytes.substr(at, client::RecordingUpload::kMaxPiece));
    ASSERT_TRUE(upload.taken(std::chrono::milliseconds(kTimeout)));
  }
  upload.finish();
  const auto answer = upload.answer(std::chrono::milliseconds(kTimeout));
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->rows(), seen_of(path).ticks.size());
  EXPECT_GT(answer->duration_s(), 0.5e-3 * static_cast<double>(answer->rows()));
  ASSERT_GT(answer->remarks_size(), 0);
  EXPECT_NE(answer->remarks(0).find("sample_sensor_force_z_n"), std::string::npos) << answer->remarks(0);
}

}  // namespace
}  // namespace hapticd::test
