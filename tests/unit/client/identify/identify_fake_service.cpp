#include "tests/unit/client/identify/identify_fake_service.h"

#include <google/protobuf/any.pb.h>
#include <google/protobuf/empty.pb.h>
#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace hapticd::test {

using std::chrono::steady_clock;

IdentifyFakeService::IdentifyFakeService(Script script) : script_(std::move(script)) {
  listen();
}

IdentifyFakeService::~IdentifyFakeService() {
  disconnect();
}

void IdentifyFakeService::listen() {
  closing_ = false;
  grpc::ServerBuilder builder;
  builder.AddListeningPort(address(), grpc::InsecureServerCredentials());
  builder.RegisterService(this);
  server_ = builder.BuildAndStart();
}

void IdentifyFakeService::disconnect() {
  if (!server_) return;
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  server_->Shutdown(std::chrono::system_clock::now());
  server_->Wait();
  server_.reset();
}

bool IdentifyFakeService::streams_to_break() const {
  return script_.break_after > 0 && broken_streams_ < script_.streams_that_break;
}

v1::IdentificationProgress IdentifyFakeService::now() const {
  if (script_.progress.empty()) return {};
  const auto step = static_cast<std::size_t>((steady_clock::now() - begin_) / script_.pace);
  const std::size_t last =
      script_.progress.size() - (streams_to_break() && script_.progress.size() > 1 ? 2 : 1);
  v1::IdentificationProgress progress = script_.progress[std::min(step, last)];
  if (cancel_asked_) {
    progress.set_state(v1::IDENTIFICATION_STATE_CANCELLED);
    progress.set_model(std::string(64, 'c'));
  }
  return progress;
}

grpc::Status IdentifyFakeService::StartIdentification(grpc::ServerContext* /*context*/,
                                                      const v1::StartIdentificationRequest* request,
                                                      v1::StartIdentificationResponse* response) {
  const std::lock_guard lock(mutex_);
  started_.push_back(*request);
  begin_ = steady_clock::now();
  if (script_.start_refusal) return *script_.start_refusal;
  response->set_identification("contact-7");
  return grpc::Status::OK;
}

grpc::Status IdentifyFakeService::WatchIdentification(
    grpc::ServerContext* context, const v1::WatchIdentificationRequest* request,
    grpc::ServerWriter<v1::IdentificationProgress>* writer) {
  std::unique_lock lock(mutex_);
  watched_names_.push_back(request->identification());
  if (script_.watch_refusal) return *script_.watch_refusal;
  const bool breaks = streams_to_break();
  const bool falls_silent = script_.silent_after > 0 && silent_streams_ < script_.streams_that_fall_silent;
  if (falls_silent) ++silent_streams_;
  for (int reported = 0; !closing_ && !context->IsCancelled(); ++reported) {
    if (breaks && reported == script_.break_after) {
      ++broken_streams_;
      return script_.break_status;
    }
    if (!falls_silent || reported < script_.silent_after) {
      const v1::IdentificationProgress progress = now();
      lock.unlock();
      const bool written = writer->Write(progress);
      lock.lock();
      if (!written) break;
      if (progress.state() > v1::IDENTIFICATION_STATE_RUNNING) return grpc::Status::OK;
    }
    changed_.wait_for(lock, script_.pace);
  }
  return {grpc::StatusCode::UNAVAILABLE, "the daemon ends"};
}

grpc::Status IdentifyFakeService::CancelIdentification(grpc::ServerContext* /*context*/,
                                                       const v1::CancelIdentificationRequest* /*request*/,
                                                       v1::IdentificationProgress* response) {
  const std::lock_guard lock(mutex_);
  ++cancelled_;
  cancel_asked_ = true;
  changed_.notify_all();
  *response = now();
  return grpc::Status::OK;
}

grpc::Status IdentifyFakeService::ListIdentifications(grpc::ServerContext* /*context*/,
                                                      const v1::ListIdentificationsRequest* /*request*/,
                                                      v1::ListIdentificationsResponse* response) {
  const std::lock_guard lock(mutex_);
  for (const auto& progress : script_.progress) *response->add_identifications() = progress;
  return grpc::Status::OK;
}

grpc::Status IdentifyFakeService::UploadRecording(grpc::ServerContext* context,
                                                  grpc::ServerReader<v1::UploadRecordingRequest>* reader,
                                                  v1::UploadRecordingResponse* response) {
  v1::UploadRecordingRequest piece;
  while (reader->Read(&piece)) {
    std::unique_lock lock(mutex_);
    pieces_.push_back(piece);
    uploaded_ += piece.csv();
    if (script_.upload_refused_after && uploaded_.size() >= *script_.upload_refused_after) {
      return script_.upload_refusal;
    }
    if (script_.upload_stalls_after && uploaded_.size() >= *script_.upload_stalls_after) {
      while (!closing_ && !context->IsCancelled()) changed_.wait_for(lock, script_.pace);
      return {grpc::StatusCode::CANCELLED, "given up"};
    }
  }
  const std::lock_guard lock(mutex_);
  response->set_recording("recording-3");
  response->set_rows(1234);
  response->set_duration_s(1.233);
  response->add_remarks("2 gaps of more than 5 ms were left out");
  return grpc::Status::OK;
}

grpc::Status IdentifyFakeService::refusal(grpc::StatusCode code, const v1::ErrorDetail& detail) {
  // google.rpc.Status {1: code, 3: details}; there is no header of it, so it is written as unknown fields.
  google::protobuf::Any any;
  any.PackFrom(detail);
  google::protobuf::Empty status;
  auto* fields = status.GetReflection()->MutableUnknownFields(&status);
  fields->AddVarint(1, static_cast<std::uint64_t>(code));
  fields->AddLengthDelimited(3, any.SerializeAsString());
  return {code, detail.what(), status.SerializeAsString()};
}

v1::IdentificationProgress contact_progress(double completion) {
  v1::IdentificationProgress progress;
  progress.set_identification("contact-7");
  progress.set_kind("contact");
  progress.set_object("sponge");
  progress.set_state(v1::IDENTIFICATION_STATE_RUNNING);
  progress.set_duration_s(20.0 * completion);
  progress.set_time_limit_s(60.0);
  progress.set_samples(static_cast<std::uint64_t>(12000.0 * completion));
  const auto parameter = [&progress](const char* name, const char* unit, double value, double error) {
    auto* p = progress.add_parameters();
    p->set_name(name);
    p->set_unit(unit);
    p->set_value(value);
    p->set_standard_error(error);
  };
  parameter("stiffness", "N/mm^m", 0.07912, 0.00118);
  parameter("damping", "N*s/mm^(m+1)", 0.00042, 0.00011);
  parameter("exponent", "1", 1.634, 0.021);
  progress.set_residual(0.0412);
  auto* map = progress.add_coverage();
  const auto axis = [](v1::CoverageMap::Axis* a, const char* quantity, const char* unit, double to,
                       std::uint32_t bins) {
    a->set_quantity(quantity);
    a->set_unit(unit);
    a->set_to(to);
    a->set_bins(bins);
  };
  axis(map->mutable_x(), "displacement", "mm", 8.0, 8);
  axis(map->mutable_y(), "speed", "mm/s", 60.0, 6);
  int required = 0;
  int enough = 0;
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 8; ++x) {
      const bool wanted = y < 4 && x < 7;
      const bool visited = (x + 1) * (y + 1) <= 28.0 * completion;
      map->add_required(wanted);
      map->add_enough(!wanted || visited);
      map->add_counts(visited ? static_cast<std::uint32_t>(50 + 400 / ((x + 1) * (y + 1))) : 0U);
      required += wanted ? 1 : 0;
      enough += wanted && visited ? 1 : 0;
    }
  }
  map->set_share(static_cast<double>(enough) / required);
  progress.set_fit_x("displacement [mm]");
  progress.set_fit_y("force [N]");
  for (int i = 0; i < 60; ++i) {
    auto* point = progress.add_fit();
    const double x = 8.0 * completion * i / 59.0;
    point->set_x(x);
    point->set_model(0.07912 * std::pow(x, 1.634));
    point->set_measured(point->model() + 0.08 * std::sin(7.0 * x));
  }
  progress.set_completion(completion);
  progress.set_instruction("Press deeper than 6 mm, slowly, three times");
  progress.add_missing("displacement from 6 to 7 mm below 20 mm/s");
  progress.add_missing("displacement from 3 to 7 mm at 20 to 40 mm/s");
  progress.add_remarks("14 samples were left out: the sensor was saturated");
  return progress;
}

v1::IdentificationProgress contact_end(v1::IdentificationState state) {
  v1::IdentificationProgress progress = contact_progress(1.0);
  progress.set_state(state);
  if (state == v1::IDENTIFICATION_STATE_FAILED) {
    progress.mutable_problem()->set_what("the guard stopped the device");
    progress.mutable_problem()->set_remedy("hapticctl clear");
    return progress;
  }
  progress.set_model("3f9a12bc77aa" + std::string(52, '0'));
  if (state != v1::IDENTIFICATION_STATE_CONVERGED) return progress;
  progress.set_steady(true);
  progress.set_certain(true);
  progress.mutable_coverage(0)->set_share(1.0);
  for (bool& enough : *progress.mutable_coverage(0)->mutable_enough()) enough = true;
  progress.clear_missing();
  progress.clear_instruction();
  return progress;
}

}  // namespace hapticd::test
