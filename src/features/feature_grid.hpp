#pragma once
#include <cstdint>
#include <vector>
#include <algorithm>
#include <cmath>
#include "features/features.hpp"
#include "geometry/camera.hpp"
namespace ipl_slam {
class FeatureGrid {
 public:
  FeatureGrid() = default;
  FeatureGrid(const Features& f, const Camera& c) {
    x_.resize(f.size()); y_.resize(f.size()); l_.resize(f.size());
    cols_ = c.width / 10 + 12; rows_ = c.height / 10 + 12;
    std::vector<int> cell(f.size());
    start_.assign(cols_ * rows_ + 1, 0);
    for (size_t i = 0; i < f.size(); ++i) { x_[i]=f.keypoints[i].undistorted.x(); y_[i]=f.keypoints[i].undistorted.y(); l_[i]=f.keypoints[i].level;
      cell[i]=cy(y_[i])*cols_+cx(x_[i]); ++start_[cell[i]+1]; }
    for (size_t i=1;i<start_.size();++i) start_[i]+=start_[i-1];
    items_.resize(f.size()); auto pos=start_;
    for (size_t i=0;i<f.size();++i) items_[pos[cell[i]]++]=i;
  }
  template <class Fn> void for_each_in_radius(float u,float v,float r,int lo,int hi,Fn&& fn) const {
    if (items_.empty()) return;
    for (int y=cy(v-r);y<=cy(v+r);++y) { int a=start_[y*cols_+cx(u-r)], b=start_[y*cols_+cx(u+r)+1];
      for (int k=a;k<b;++k){ int i=items_[k]; if (l_[i]<lo||l_[i]>hi) continue; float dx=x_[i]-u,dy=y_[i]-v; if (dx*dx+dy*dy<=r*r) fn(i);} }
  }
 private:
  int cx(float x) const { return std::clamp((int)std::floor(x/10)+6,0,cols_-1);} 
  int cy(float y) const { return std::clamp((int)std::floor(y/10)+6,0,rows_-1);} 
  int cols_=0, rows_=0; std::vector<int> start_, items_, l_; std::vector<float> x_,y_;
};
}
