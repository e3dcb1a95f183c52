#include "tests/measure/study/extremes/fed_scene.h"

#include "hal/sim/simulated_rig.h"
#include "rt/scene/compose.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/support/value_of.h"

namespace hapticd::study::extremes {

using test::value_of;

rt::SceneSpec tap_scene() {
  rt::SceneSpec scene;
  scene.name = "tap_1d";
  scene.max_target_stiffness_n_per_mm = 1000.0;
  return scene;
}

FedScene::FedScene(const rt::SceneSpec& scene, const rt::ObjectModel* model)
    : info_(value_of(sim::SimulatedRig::create(explore_rig("phantom_1_5_high_force", "foam_ball_3d", "rod")))
                ->info()),
      scene_(value_of(rt::resolve(scene, info_))),
      pipeline_(value_of(rt::compose(scene_, info_, model))),
      renderer_(std::make_unique<rt::Renderer>(scene_.guard, info_.rate_hz)) {
  renderer_->exchange(pipeline_.get(), scene_.guard);
}

}  // namespace hapticd::study::extremes
