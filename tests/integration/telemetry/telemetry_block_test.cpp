// The block encoding holds what the encoding by fields holds, column by column.

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "hapticd/v1/telemetry.grpc.pb.h"
#include "server/grpc/messages/telemetry_encoding.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// A record in which no two numbers are the same, as far as their kinds allow.
rt::TickRecord record_of(std::uint64_t tick, std::uint32_t channels) {
  rt::TickRecord r;
  double next = 1.5 + 100.0 * static_cast<double>(tick);
  for (hal::Vector3* v : {&r.tip_position_mm,
                          &r.sensor_force_n,
                          &r.sensor_torque_n_mm,
                          &r.zero.force_n,
                          &r.zero.torque_n_mm,
                          &r.jump_n,
                          &r.last_jump_n,
                          &r.device_command_n,
                          &r.normal,
                          &r.reaction_n,
                          &r.friction_force_n,
                          &r.inclusion_position_mm,
                          &r.inclusion_force_n,
                          &r.friction_added_n,
                          &r.truth.tip_position_mm,
                          &r.truth.hand_force_n,
                          &r.truth.reaction_force_n,
                          &r.truth.device_force_n,
                          &r.truth.outward_normal,
                          &r.truth.undeformed_contact_mm}) {
    *v = {next, next + 0.25, next + 0.5};
    next += 1.0;
  }
  for (double* d : {&r.velocity_mm_per_s,
                    &r.acceleration_mm_per_s2,
                    &r.reaction_force_n,
                    &r.contact_authority,
                    &r.contact_force_n,
                    &r.displacement_mm,
                    &r.target_stiffness_n_per_mm,
                    &r.desired_force_n,
                    &r.commanded_force_n,
                    &r.hand_force_n,
                    &r.feasible_min_n_per_mm,
                    &r.feasible_max_n_per_mm,
                    &r.authority,
                    &r.sliding_mm_per_s,
                    &r.law_displacement_mm,
                    &r.displacement_deviation_mm,
                    &r.hand_energy_mj,
                    &r.passivity_damping_n_s_per_mm,
                    &r.friction_scale,
                    &r.friction_feasible_min,
                    &r.friction_feasible_max,
                    &r.transient_force_n,
                    &r.transient_impact_mm_per_s,
                    &r.transient_share,
                    &r.truth.displacement_mm,
                    &r.truth.normal_force_n,
                    &r.truth.friction_force_n}) {
    *d = next += 1.0;
  }
  r.tick = tick;
  r.time_ns = 9'007'199'254'740'993 + static_cast<std::int64_t>(tick);  // no double holds it
  r.scene_generation = 7;
  r.channels = channels;
  r.tip_orientation = {0.5, 0.1, -0.2, 0.3};
  r.sample_status = 3;
  r.force_count = 11;
  r.force_age_ns = 1'250'000;
  r.bias_serial = 5;
  r.in_contact = r.truth.in_contact = r.friction_is_bounded = true;
  r.contact_reason = rt::ContactReason::kHeld;
  r.contact_count = 21;
  r.withdrawn_count = 2;
  r.jump_count = 6;
  r.guard_state = rt::GuardState::kLatched;
  r.guard_fault = rt::GuardFault::kOscillation;
  r.guard_limits = 4;
  r.faults_present = 65;
  r.timing = {-17, 23, 31, 2, rt::OverrunCause::kCompute};
  r.inclusion = 1;
  r.transient_count = 9;
  return r;
}

server::Subscription::Batch batch_of(const std::vector<rt::TickRecord>& records) {
  const auto chunk = std::make_shared<server::RecordChunk>();
  chunk->records = records;
  server::Subscription::Batch batch;
  for (std::uint32_t i = 0; i < records.size(); ++i) batch.entries.push_back({chunk, i});
  batch.dropped_by_subscriber = 3;
  batch.dropped_by_server = 4;
  return batch;
}

v1::TelemetryBatch decoded(grpc::ByteBuffer bytes) {
  v1::TelemetryBatch message;
  EXPECT_TRUE(grpc::SerializationTraits<v1::TelemetryBatch>::Deserialize(&bytes, &message).ok());
  return message;
}

double number_of(const Message& message, const FieldDescriptor& field) {
  const auto& access = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return access.GetDouble(message, &field);
    case FieldDescriptor::CPPTYPE_BOOL:
      return access.GetBool(message, &field) ? 1.0 : 0.0;
    case FieldDescriptor::CPPTYPE_ENUM:
      return access.GetEnumValue(message, &field);
    case FieldDescriptor::CPPTYPE_INT64:
      return static_cast<double>(access.GetInt64(message, &field));
    case FieldDescriptor::CPPTYPE_UINT32:
      return access.GetUInt32(message, &field);
    default:
      ADD_FAILURE() << field.full_name();
      return 0.0;
  }
}

/// Each number of the groups of a sample by the name that recordings give it.
std::map<std::string, double> numbers_of(const v1::TelemetrySample& sample) {
  std::map<std::string, double> numbers;
  for (int g = 0; g < sample.GetDescriptor()->field_count(); ++g) {
    const FieldDescriptor& group = *sample.GetDescriptor()->field(g);
    if (group.message_type() == nullptr || !sample.GetReflection()->HasField(sample, &group)) continue;
    const Message& of_group = sample.GetReflection()->GetMessage(sample, &group);
    for (int q = 0; q < group.message_type()->field_count(); ++q) {
      const FieldDescriptor& quantity = *group.message_type()->field(q);
      const std::string own = group.name() + "_";
      const std::string prefix = quantity.name().starts_with(own) ? "" : own;
      if (quantity.message_type() == nullptr) {
        numbers[prefix + quantity.name()] = number_of(of_group, quantity);
        continue;
      }
      const Message& vector = of_group.GetReflection()->GetMessage(of_group, &quantity);
      for (int c = 0; c < quantity.message_type()->field_count(); ++c) {
        const FieldDescriptor& component = *quantity.message_type()->field(c);
        // The unit stays whole: "sensor_torque_x_n_mm".
        const auto unit =
            quantity.name().ends_with("_n_mm") ? quantity.name().size() - 5 : quantity.name().rfind('_');
        const std::string name =
            unit == std::string::npos
                ? quantity.name() + "_" + component.name()
                : quantity.name().substr(0, unit) + "_" + component.name() + quantity.name().substr(unit);
        numbers[prefix + name] = number_of(vector, component);
      }
    }
  }
  return numbers;
}

template <class T>
T cell(const v1::TelemetryBlock& block, std::size_t columns, std::size_t row, std::size_t column) {
  T value;
  std::memcpy(&value, block.rows().data() + 8 * (row * columns + column), 8);
  return value;
}

TEST(TelemetryBlock, HoldsEveryNumberOfASampleUnderItsName) {
  const std::vector<rt::TickRecord> records{record_of(1, ~0U), record_of(2, ~0U)};
  const v1::TelemetryBatch samples = decoded(server::encode(batch_of(records), ~0U));
  const v1::TelemetryBatch batch = decoded(server::encode_block(batch_of(records), ~0U, true));
  EXPECT_EQ(batch.dropped_by_subscriber(), 3U);
  EXPECT_EQ(batch.dropped_by_server(), 4U);
  const v1::TelemetryBlock& block = batch.block();
  const auto columns = static_cast<std::size_t>(block.columns_size());
  ASSERT_EQ(block.rows().size(), 2 * 8 * columns);
  for (std::size_t row = 0; row < 2; ++row) {
    const v1::TelemetrySample& sample = samples.samples(static_cast<int>(row));
    EXPECT_EQ(cell<std::int64_t>(block, columns, row, 0), static_cast<std::int64_t>(sample.tick()));
    EXPECT_EQ(cell<std::int64_t>(block, columns, row, 1), sample.time_ns());
    EXPECT_EQ(cell<std::int64_t>(block, columns, row, 2), 7);
    std::map<std::string, double> expected = numbers_of(sample);
    for (std::size_t i = 3; i < columns; ++i) {
      const v1::TelemetryColumn& column = block.columns(static_cast<int>(i));
      EXPECT_EQ(column.type(), v1::COLUMN_TYPE_FLOAT64);
      EXPECT_FALSE(column.unit().empty());
      ASSERT_TRUE(expected.contains(column.name())) << column.name();
      EXPECT_EQ(cell<double>(block, columns, row, i), expected[column.name()]) << column.name();
      expected.erase(column.name());
    }
    for (const auto& [name, value] : expected) ADD_FAILURE() << "no column " << name;
  }
}

TEST(TelemetryBlock, DescribesItsColumnsOnceAndMarksAbsentGroups) {
  using namespace rt::channel;
  const std::vector<rt::TickRecord> records{record_of(1, kSample)};
  const auto first = decoded(server::encode_block(batch_of(records), kContact | kDeformation, true)).block();
  EXPECT_EQ(first.columns_size(), 3 + 7 + 1);
  EXPECT_TRUE(std::isnan(cell<double>(first, 11, 0, 10))) << "the scene has no such group";
  const auto next = decoded(server::encode_block(batch_of(records), kContact | kDeformation, false)).block();
  EXPECT_EQ(next.columns_size(), 0);
  EXPECT_EQ(next.rows(), first.rows());
}

TEST(TelemetryBlock, StreamsFromADaemon) {
  const RunningService service(config_with_scene("tap_1d"));
  v1::SubscribeRequest request;
  request.add_groups(v1::FIELD_GROUP_SAMPLE);
  request.add_groups(v1::FIELD_GROUP_CONTACT);
  request.set_encoding(v1::TELEMETRY_ENCODING_BLOCK);
  const auto context = call_context();
  const auto stream = v1::TelemetryService::NewStub(service.channel)->Subscribe(context.get(), request);
  std::size_t columns = 0;
  std::int64_t last_tick = 0;
  std::size_t rows = 0;
  v1::TelemetryBatch batch;
  while (rows < 200 && stream->Read(&batch)) {
    EXPECT_EQ(batch.samples_size(), 0);
    if (columns == 0) columns = static_cast<std::size_t>(batch.block().columns_size());
    ASSERT_GT(columns, 0U);
    ASSERT_EQ(batch.block().rows().size() % (8 * columns), 0U);
    for (std::size_t row = 0; row < batch.block().rows().size() / (8 * columns); ++row, ++rows) {
      const auto tick = cell<std::int64_t>(batch.block(), columns, row, 0);
      if (last_tick != 0 && batch.dropped_by_subscriber() + batch.dropped_by_server() == 0) {
        EXPECT_EQ(tick, last_tick + 1);
      }
      last_tick = tick;
    }
  }
  EXPECT_GE(rows, 200U);
  context->TryCancel();
  stream->Finish();
}

}  // namespace
}  // namespace hapticd::test
