// field_simulate from the command line: the bundled bags come out bit for bit, bad worlds are
// refused.
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "program_runner.hpp"

namespace field_bags {
namespace {

const char* const kWorld =
    "duration: 20\n"
    "area: [-2, -2, 2, 2]\n"
    "gp_fields: {light: {mean: 5, signal_stddev: 1, length_scales: [1, 1], noise_stddev: 0.1}}\n"
    "route: {kind: random_waypoints}\n";

class FieldSimulate : public ::testing::Test {
 protected:
  ProgramResult simulate(const std::string& world, int seed = 1) {
    folder_.write("world.yaml", world);
    return run(std::string(FIELD_SIMULATE) + " --world " + (folder_ / "world.yaml") + " --seed " +
               std::to_string(seed) + " --output " + (folder_ / "out.bag"));
  }
  void expect_refused(const std::string& world, const std::vector<std::string>& texts) {
    const ProgramResult result = simulate(world);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.error_lines(), 1) << result.err;
    for (const std::string& text : texts) {
      EXPECT_NE(result.err.find(text), std::string::npos) << text << " not in: " << result.err;
    }
    EXPECT_EQ(folder_.files(), 1u) << "something half-written is left";
  }
  static std::string with(const std::string& from, const std::string& to) {
    std::string world = kWorld;
    return world.replace(world.find(from), from.size(), to);
  }
  ScratchFolder folder_;
};

/// The hashes that sha256sum computes, by file.
std::map<std::string, std::string> sha256(const std::string& arguments) {
  std::istringstream lines(run("sha256sum " + arguments).out);
  std::map<std::string, std::string> hashes;
  for (std::string hash, file; lines >> hash >> file;) hashes[file] = hash;
  return hashes;
}

TEST(BundledBags, AreThoseOfTheManifestAndSmall) {
  const ProgramResult check = run("sha256sum --strict --check MANIFEST.sha256");
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  std::size_t bags = 0;
  for (const auto& entry : std::filesystem::directory_iterator("bags")) {
    ++bags;
    EXPECT_LT(entry.file_size(), 2000000u) << entry.path();
    EXPECT_NE(read_file("MANIFEST.sha256").find(entry.path().string()), std::string::npos);
  }
  EXPECT_GE(bags, 3u);
}

TEST(BundledBags, AreRegeneratedBitForBitFromTheirWorlds) {
  const std::map<std::string, int> seeds{{"office_wifi", 1},
                                         {"hall_light", 2},
                                         {"warehouse_magnetic", 3},
                                         {"beacons", 4},
                                         {"two_robots_light", 5}};
  const ScratchFolder folder;
  for (const auto& [name, seed] : seeds) {
    const std::string output = folder / (name + ".bag");
    const ProgramResult result =
        run(std::string(FIELD_SIMULATE) + " --world worlds/" + name + ".yaml --seed " +
            std::to_string(seed) + " --output " + output);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto made = sha256(output), bundled = sha256("bags/" + name + ".bag");
    EXPECT_EQ(made.begin()->second, bundled.begin()->second) << name;
  }
}

TEST_F(FieldSimulate, SeedDecidesTheBytes) {
  ASSERT_EQ(simulate(kWorld, 1).exit_code, 0);
  const std::string first = read_file(folder_ / "out.bag");
  ASSERT_EQ(simulate(kWorld, 1).exit_code, 0);
  EXPECT_EQ(read_file(folder_ / "out.bag"), first);
  ASSERT_EQ(simulate(kWorld, 2).exit_code, 0);
  EXPECT_NE(read_file(folder_ / "out.bag"), first);
}

TEST_F(FieldSimulate, RefusesBadKeysNamingLineAndKey) {
  expect_refused(with("duration: 20", "duratoin: 20"), {"world.yaml:1", "duratoin"});
  expect_refused(with("duration: 20\n", ""), {"duration"});
  expect_refused(with("duration: 20", "duration: long"), {"world.yaml:1", "duration", "long"});
  expect_refused(with("mean: 5, ", ""), {"world.yaml:3", "gp_fields/light", "mean"});
  expect_refused(with("noise_stddev: 0.1", "noise_stddev: -1"), {"world.yaml:3", "noise_stddev"});
  expect_refused(with("random_waypoints", "circles"), {"world.yaml:4", "route/kind", "circles"});
}

TEST_F(FieldSimulate, RefusesWorldsThatMakeNoSense) {
  expect_refused(with("[-2, -2, 2, 2]", "[2, -2, -2, 2]"), {"world.yaml:2", "area"});
  expect_refused(with("random_waypoints}", "random_waypoints, margin: 2}"), {"route/margin"});
  expect_refused(with("random_waypoints", "waypoints"), {"route/waypoints", "two points"});
  expect_refused(with("random_waypoints}", "random_waypoints}\nrobots: {anna: {joins: 3}}"),
                 {"robots/anna/route/waypoints", "two points"});
  expect_refused(with("random_waypoints}",
                      "random_waypoints}\nrobots: {a b: {route: {kind: random_waypoints}}}"),
                 {"robots/a b", "letters"});
  expect_refused("duration: 9\narea: [0, 0, 1, 1]\nroute: {kind: lawn_mower}\n", {"no field"});
}

TEST_F(FieldSimulate, CommandLineMisuseIsExitTwo) {
  EXPECT_EQ(run(FIELD_SIMULATE).exit_code, 2);
  EXPECT_EQ(run(std::string(FIELD_SIMULATE) + " --world w --output o --seed many").exit_code, 2);
  EXPECT_EQ(run(std::string(FIELD_SIMULATE) + " --help").exit_code, 0);
  const ProgramResult none =
      run(std::string(FIELD_SIMULATE) + " --world none.yaml --seed 1 --output " + (folder_ / "b"));
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("none.yaml"), std::string::npos);
}

TEST_F(FieldSimulate, PrintsTheKeysOfAWorld) {
  const ProgramResult keys = run(std::string(FIELD_SIMULATE) + " --world-keys");
  EXPECT_EQ(keys.exit_code, 0) << keys.err;
  for (const char* key : {"translation_scale", "path_loss_exponent", "multipath", "earth_field"}) {
    EXPECT_NE(keys.out.find(key), std::string::npos) << key;
  }
}

}  // namespace
}  // namespace field_bags
