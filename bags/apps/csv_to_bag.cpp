// Anyone's logs into a bag: see README.md for the columns.
#include <iostream>

#include "field_bags/bag_writer.hpp"
#include "field_bags/csv_recording.hpp"
#include "field_bags/program.hpp"

int main(int argc, char** argv) {
  CLI::App app(
      "Writes CSV logs as a bag with /odom, /tf, /field and, with --truth, /ground_truth.\n"
      "Poses have the columns stamp_s,x_m,y_m,yaw_rad; measurements have stamp_s and one column "
      "per\n"
      "field, an empty cell where a field was not observed.",
      "csv_to_bag");
  std::string odometry, measurements, truth, output;
  app.add_option("--odom", odometry, "accumulated odometry (CSV)")->required();
  app.add_option("--measurements", measurements, "readings of the fields (CSV)")->required();
  app.add_option("--truth", truth, "true poses in the map frame (CSV)");
  bool sort = false;
  app.add_flag("--sort", sort,
               "the rows of the measurements may come in any order: sort them by stamp_s, and join "
               "rows that share one");
  app.add_option("--output", output, "bag to write; replaced if it exists")->required();
  return field_bags::run_program(app, argc, argv, [&]() {
    const auto recording = field_bags::read_csv_recording(
        odometry, measurements, truth,
        sort ? field_bags::RowOrder::any : field_bags::RowOrder::increasing);
    field_bags::write_bag({recording}, output);
    std::cout << output << ": " << recording.odometry.size() << " odometry poses, "
              << recording.measurements.size() << " measurements of " << recording.fields.size()
              << (recording.fields.size() == 1 ? " field\n" : " fields\n");
    if (recording.repeated > 0) {
      std::cout << measurements << ": " << recording.repeated
                << " readings left out: the same field at the same stamp, the first one stands\n";
    }
  });
}
