#include "legend.hpp"

#include <QPainter>
#include <cmath>

namespace field_rviz_plugins {
namespace {

constexpr int kWidth = 132, kHeight = 236;
constexpr int kMargin = 10, kTitle = 40, kBar = 20, kTick = 5;
const QColor kPaper(20, 20, 24, 190), kInk(235, 235, 235);

QRect bar() { return {kMargin, kTitle, kBar, kHeight - kTitle - kMargin - 4}; }

void draw_bar(QPainter& painter, ColourMap colours) {
  const QRect place = bar();
  for (int y = 0; y < place.height(); ++y) {
    const Rgb c = colour(colours, 1.0 - (y + 0.5) / place.height());
    painter.fillRect(place.left(), place.top() + y, place.width(), 1, QColor(c[0], c[1], c[2]));
  }
  painter.setPen(kInk);
  painter.drawRect(place.adjusted(-1, -1, 0, 0));
}

void draw_ticks(QPainter& painter, double low, double high) {
  const QRect place = bar();
  for (const double value : ticks(low, high)) {
    const double share = high > low ? (value - low) / (high - low) : 0.5;
    const int y = place.bottom() - static_cast<int>(std::lround(share * (place.height() - 1)));
    const int x = place.right() + 2;
    painter.drawLine(x, y, x + kTick, y);
    painter.drawText(QRect(x + kTick + 4, y - 9, kWidth, 18), Qt::AlignVCenter | Qt::AlignLeft,
                     QString::number(value, 'g', 4));
  }
}

}  // namespace

std::vector<double> ticks(double low, double high) {
  if (!(high > low) || !std::isfinite(high - low)) return {low};
  const double power = std::pow(10.0, std::floor(std::log10((high - low) / 3.0)));
  double step = power;
  for (const double factor : {5.0, 2.0}) {
    if (std::floor(high / (factor * power)) - std::ceil(low / (factor * power)) >= 2.0) {
      step = factor * power;
      break;
    }
  }
  std::vector<double> out;
  const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
  for (double k = first; k <= last; ++k) out.push_back(k == 0.0 ? 0.0 : k * step);
  return out;
}

QImage draw_legend(const std::string& title, const std::string& unit, ColourMap colours, double low,
                   double high) {
  QImage picture(kWidth, kHeight, QImage::Format_RGBA8888);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  painter.setRenderHint(QPainter::Antialiasing, false);
  painter.fillRect(picture.rect(), kPaper);
  QFont font = painter.font();
  font.setPixelSize(13);
  font.setBold(true);
  painter.setFont(font);
  painter.setPen(kInk);
  const QRect line(kMargin, 4, kWidth - 2 * kMargin, 17);
  painter.drawText(line, Qt::AlignVCenter | Qt::AlignLeft, QString::fromStdString(title));
  font.setBold(false);
  font.setPixelSize(12);
  painter.setFont(font);
  const bool plain = unit.empty() || unit == "1";
  painter.drawText(line.translated(0, 15), Qt::AlignVCenter | Qt::AlignLeft,
                   plain ? QString() : "[" + QString::fromStdString(unit) + "]");
  draw_bar(painter, colours);
  painter.setPen(kInk);
  draw_ticks(painter, low, high);
  return picture;
}

}  // namespace field_rviz_plugins
