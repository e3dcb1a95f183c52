#include "rt/guard/fault_table.h"

namespace hapticd::rt {

std::string_view to_text(FaultAction action) noexcept {
  switch (action) {
    case FaultAction::kWarn:
      return "warn";
    case FaultAction::kRampToZero:
      return "ramp to zero";
    case FaultAction::kCut:
      return "cut";
  }
  return "";
}

std::string_view to_text(FaultClearing clearing) noexcept {
  switch (clearing) {
    case FaultClearing::kItself:
      return "itself, with its cause";
    case FaultClearing::kAnyClient:
      return "an operator";
  }
  return "";
}

std::string fault_table_markdown() {
  std::string text =
      "| fault | noticed by | action | latched | cleared by | filters start again | remedy |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const FaultRule& rule : kFaultTable) {
    const bool latched = rule.clearing != FaultClearing::kItself;
    const auto add = [&text](std::string_view cell) { text.append(" ").append(cell).append(" |"); };
    text += "|";
    add("`" + std::string(rule.name) + "`");
    add(rule.cause);
    add(to_text(rule.action));
    add(latched ? "yes" : "no");
    add(to_text(rule.clearing));
    add(rule.restarts ? "yes" : "no");
    add(rule.remedy);
    text += "\n";
  }
  return text;
}

}  // namespace hapticd::rt
