#pragma once

#include <atomic>
#include <string>

#include "hapticd/v1/recording.grpc.pb.h"

namespace hapticd::server {

class FlightRecorder;
class Recorder;

/// Recordings and incidents.
class RecordingService final : public v1::RecordingService::Service {
 public:
  static constexpr int kMaxDownloads = 4;
  static constexpr int kMaxExports = 2;

  RecordingService(Recorder& recorder, FlightRecorder& flight, std::string folder)
      : recorder_(recorder), flight_(flight), folder_(std::move(folder)) {}

  grpc::Status StartRecording(grpc::ServerContext* context, const v1::StartRecordingRequest* request,
                              v1::RecordingFile* response) override;
  grpc::Status StopRecording(grpc::ServerContext* context, const v1::StopRecordingRequest* request,
                             v1::RecordingFile* response) override;
  grpc::Status Annotate(grpc::ServerContext* context, const v1::AnnotateRequest* request,
                        v1::AnnotateResponse* response) override;
  grpc::Status ListRecordings(grpc::ServerContext* context, const v1::ListRecordingsRequest* request,
                              v1::ListRecordingsResponse* response) override;
  grpc::Status GetRecording(grpc::ServerContext* context, const v1::GetRecordingRequest* request,
                            grpc::ServerWriter<v1::RecordingPiece>* writer) override;
  grpc::Status ExportRecording(grpc::ServerContext* context, const v1::ExportRecordingRequest* request,
                               grpc::ServerWriter<v1::RecordingPiece>* writer) override;
  grpc::Status DeleteRecording(grpc::ServerContext* context, const v1::DeleteRecordingRequest* request,
                               v1::RecordingFile* response) override;
  grpc::Status MakeIncident(grpc::ServerContext* context, const v1::MakeIncidentRequest* request,
                            v1::MakeIncidentResponse* response) override;

 private:
  Recorder& recorder_;
  FlightRecorder& flight_;
  const std::string folder_;
  std::atomic<int> downloads_{0};
  std::atomic<int> exports_{0};
};

}  // namespace hapticd::server
