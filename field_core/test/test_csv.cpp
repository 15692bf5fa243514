#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <limits>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "support.hpp"

namespace field_core {
namespace {

CsvTable parse(const std::string& text) { return CsvTable::parse(text, "log.csv"); }

TEST(Csv, ReadsColumnsByNameAndKeepsLineNumbers) {
  const CsvTable table = parse("stamp_s, light\n1.5,7\n\n2.5, -0.25 \n");
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_EQ(table.columns(), (std::vector<std::string>{"stamp_s", "light"}));
  EXPECT_EQ(table.stamp(0, table.column("stamp_s")), Stamp(1500000000));
  EXPECT_EQ(table.number(1, table.column("light")), -0.25);
  EXPECT_EQ(table.line(0), 2u);
  EXPECT_EQ(table.line(1), 4u);
  EXPECT_FALSE(table.has_column("heat"));
}

TEST(Csv, ToleratesCrLfByteOrderMarkAndMissingLastNewline) {
  const CsvTable table = parse(
      "\xEF\xBB\xBF"
      "a,b\r\n1,\r\n+2,3e2");
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_EQ(table.columns()[0], "a");
  EXPECT_TRUE(table.empty(0, 1));
  EXPECT_EQ(table.number(1, 0), 2.0);
  EXPECT_EQ(table.number(1, 1), 300.0);
}

TEST(Csv, QuotedCells) {
  const CsvTable table = parse("\"a\",\"b, with comma\"\n\"say \"\"hi\"\"\" , \"2\"\n");
  EXPECT_EQ(table.columns()[1], "b, with comma");
  EXPECT_EQ(table.text(0, 0), "say \"hi\"");
  EXPECT_EQ(table.number(0, 1), 2.0);
  test::expect_error<DataError>([] { parse("a\n\"1"); }, {"log.csv:2", "quote"});
  test::expect_error<DataError>([] { parse("a\n\"1\"2"); }, {"log.csv:2", "quote"});
}

TEST(Csv, BadTablesAreRefusedByLine) {
  test::expect_error<DataError>([] { parse(""); }, {"log.csv", "empty"});
  test::expect_error<DataError>([] { parse("\n \n"); }, {"log.csv", "empty"});
  test::expect_error<DataError>([] { parse("a,b\n1,2\n1,2,3\n"); }, {"log.csv:3", "3 cells", "2"});
  test::expect_error<DataError>([] { parse("a,b\n1\n"); }, {"log.csv:2", "1 cells"});
  test::expect_error<DataError>([] { parse("a,b,a\n"); }, {"log.csv:1", "'a'", "twice"});
  test::expect_error<DataError>([] { parse("a,,b\n"); }, {"log.csv:1", "column 2"});
  test::expect_error<DataError>([] { parse(std::string("a\0b", 3)); }, {"log.csv", "binary"});
}

TEST(Csv, BadCellsAreRefusedByLineAndColumn) {
  for (const char* cell : {"nan", "inf", "-inf", "1e999", "1,5", "0x1F", "1.0m", "--1", "one"}) {
    SCOPED_TRACE(cell);
    const CsvTable table = parse("x_m\n0\n\"" + std::string(cell) + "\"\n");
    test::expect_error<DataError>([&] { table.number(1, 0); },
                                  {"log.csv:3", "'x_m'", cell, "not a finite number"});
  }
  const CsvTable table = parse("stamp_s,x_m\nnow,\n");
  test::expect_error<DataError>([&] { table.stamp(0, 0); }, {"log.csv:2", "'stamp_s'", "'now'"});
  test::expect_error<DataError>([&] { table.number(0, 1); }, {"log.csv:2", "'x_m'", "''"});
  test::expect_error<DataError>([&] { table.column("y_m"); }, {"log.csv", "'y_m'", "stamp_s,x_m"});
}

TEST(Csv, FilesThatCannotBeReadAreNamed) {
  const test::TemporaryFolder folder;
  test::expect_error<DataError>([&] { CsvTable::read(folder.file("none.csv")); },
                                {"none.csv", "No such file"});
  test::expect_error<DataError>([&] { CsvTable::read(folder.file("")); }, {"directory"});
}

TEST(FormatNumber, ReadsBackTheSameBits) {
  Random random(40);
  for (int k = 0; k < 2000; ++k) {
    const double value = random.normal() * std::pow(10.0, random.uniform(-300.0, 300.0));
    EXPECT_EQ(*parse_number(format_number(value)), value);
  }
  EXPECT_EQ(format_number(0.1), "0.1");
  EXPECT_EQ(format_number(1e22), "1e+22");
  EXPECT_EQ(format_number(-3.0), "-3");
  EXPECT_FALSE(parse_number(format_number(std::numeric_limits<double>::infinity())));
  EXPECT_FALSE(parse_number(""));
  EXPECT_FALSE(parse_number("+-1"));
}

TEST(WriteFile, ReplacesTheWholeFileAndLeavesNothingElse) {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("out.json", "a much longer old content");
  ::chmod(path.c_str(), 0640);
  write_file_atomically(path, "new");
  EXPECT_EQ(test::content_of(path), "new");
  struct stat info;
  ASSERT_EQ(::stat(path.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0640u);
  EXPECT_EQ(folder.count(), 1u);
  write_file_atomically(folder.file("fresh"), std::string(1000000, 'x'));
  EXPECT_EQ(test::content_of(folder.file("fresh")).size(), 1000000u);
}

TEST(WriteFile, FollowsLinksAndWritesIntoPipes) {
  const test::TemporaryFolder folder;
  const std::string target = folder.write("target", "old"), link = folder.file("link");
  ASSERT_EQ(::symlink(target.c_str(), link.c_str()), 0);
  write_file_atomically(link, "new");
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(test::content_of(target), "new");
  write_file_atomically("/dev/null", "gone");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST(WriteFile, FailureNamesThePathAndLeavesNothing) {
  const test::TemporaryFolder folder;
  test::expect_error<DataError>([&] { write_file_atomically(folder.file("no/such/f"), "x"); },
                                {"no/such/f", "No such file"});
  test::expect_error<DataError>([&] { write_file_atomically(folder.file(""), "x"); }, {"folder"});
  EXPECT_EQ(folder.count(), 0u);
}

}  // namespace
}  // namespace field_core
