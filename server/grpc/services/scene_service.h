#pragma once

#include <atomic>

#include "hal/lock/mutex.h"
#include "hapticd/v1/scene.grpc.pb.h"

namespace hapticd::server {

class SceneHost;

class SceneService final : public v1::SceneService::Service {
 public:
  explicit SceneService(SceneHost& scenes) : scenes_(scenes) {}

  grpc::Status ListScenes(grpc::ServerContext* context, const v1::ListScenesRequest* request,
                          v1::ListScenesResponse* response) override;
  grpc::Status LoadScene(grpc::ServerContext* context, const v1::LoadSceneRequest* request,
                         v1::LoadSceneResponse* response) override;
  grpc::Status UnloadScene(grpc::ServerContext* context, const v1::UnloadSceneRequest* request,
                           v1::UnloadSceneResponse* response) override;
  grpc::Status ExplainScene(grpc::ServerContext* context, const v1::ExplainSceneRequest* request,
                            v1::SceneOutline* response) override;

 private:
  SceneHost& scenes_;
  std::atomic<int> loads_{0};
  std::atomic<int> explanations_{0};
  SerialMutex measuring_;  ///< one cost at a time: two at once would disturb each other
};

}  // namespace hapticd::server
