#include <ctime>
#include <string>

#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {
/// Processor time of this thread: how fast one core is, the one who else uses the machine.
double cpu_time_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
}  // namespace

void run_speed(StudyContext& context) {
  report::MarkdownTable table({"scene", "simulated s", "times real time (CPU)"});
  for (const std::string name : {"tap_1d", "wall"}) {
    sim::SimulationConfig rig;
    rt::SceneSpec scene;
    scene.name = name;
    if (name == "wall") {
      scene.kind = rt::SceneKind::kWall;
      rig.object = "none";
    }
    VirtualRun run(rig, scene);
    run.set_hand(tapping(400.0));
    const double duration_s = context.quick ? 20.0 : 200.0;
    const double start_s = cpu_time_s();
    while (run.time_s() < duration_s) run.step();
    const double took_s = cpu_time_s() - start_s;
    report::Figure figure{"realtime_factor", {{"scene", name}}};
    figure.value = duration_s / took_s;
    if (name == "tap_1d") figure.goal = 200.0;
    context.report.add(figure);
    table.add_row({name, report::fixed(duration_s, 0), report::fixed(*figure.value, 0)});
  }
  context.report.add_table("speed", "Simulator and tick together, one core", table,
                           "10 kHz physics and sensor, 1 kHz tick, the hand tapping once a second.");
}

}  // namespace hapticd::study
