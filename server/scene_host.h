#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>

#include "hal/error.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "server/caller.h"
#include "server/outcome.h"
#include "server/scene_library.h"
#include "server/session.h"

namespace hapticd::server {

/// Where a scene comes from: a name the library knows, or the text of a scene file.
struct SceneSource {
  enum class Kind : std::uint8_t { kName, kToml };
  Kind kind = Kind::kName;
  std::string text;
};

/// A scene resolved against the rig.
struct ResolvedScene {
  rt::SceneSpec spec;
  rt::SceneOutline outline;  ///< with the channels that every tick has on this rig
};

/// Keeps the one scene that is loaded: resolves, composes, exchanges pipelines at a tick boundary, and
/// deletes the retired ones outside the loop. Any thread.
class SceneHost {
 public:
  SceneHost(Session& session, SceneLibrary library);

  /// Loaded before the loop runs, so that not a tick of a recording is missed.
  std::optional<hal::Error> preload(const std::string& name);

  struct Loaded {
    std::shared_ptr<const ResolvedScene> scene;  ///< null after an unload
    std::uint64_t effective_tick = 0;
  };
  Outcome<Loaded> load(const SceneSource& source, const Caller& caller);
  Outcome<Loaded> unload(const Caller& caller);
  /// What a scene would be made of.
  Outcome<ResolvedScene> resolve(const SceneSource& source) const;

  /// Null when none is loaded.
  std::shared_ptr<const ResolvedScene> current() const;
  const SceneLibrary& catalogue() const { return library_; }

  /// While held, the scene is not exchanged: what was validated against it is still valid when it takes
  /// effect.
  class Hold {
   public:
    bool held() const { return lock_.owns_lock(); }

   private:
    friend class SceneHost;
    std::shared_lock<std::shared_timed_mutex> lock_;
  };
  Hold hold(Caller::Clock::time_point until);

 private:
  Outcome<Loaded> exchange(std::unique_ptr<rt::Pipeline> next, const rt::GuardLimits& guard,
                           std::shared_ptr<const ResolvedScene> scene, const Caller& caller);

  Session& session_;
  SceneLibrary library_;

  // Taken in this order. The gate lets an exchange pass a steady stream of holders.
  std::timed_mutex gate_;
  std::shared_timed_mutex exchange_;

  mutable std::mutex current_mutex_;
  std::shared_ptr<const ResolvedScene> current_;
  std::unique_ptr<rt::Pipeline> live_;  ///< what the loop works with; owned here, changed under exchange_
};

}  // namespace hapticd::server
