#include "features/matcher.hpp"
namespace ipl_slam {
std::vector<int> match_projected(const Features& f, const FeatureGrid& g, std::span<const ProjectedPoint> w, const MatchOptions& o, std::span<const std::uint8_t> taken) {
  std::vector<int> out(w.size(), -1), owner(f.size(), -1), dist(f.size(), 999);
  for (size_t i=0;i<w.size();++i) {
    int best=-1,d1=999,d2=999,l1=-1,l2=-2;
    g.for_each_in_radius(w[i].uv.x(),w[i].uv.y(),w[i].radius,w[i].min_level,w[i].max_level,[&](int k){
      if (!taken.empty() && taken[k]) return;
      int d=hamming_distance(*w[i].descriptor,f.descriptors[k]);
      if (d<d1) {d2=d1;l2=l1;d1=d;l1=f.keypoints[k].level;best=k;} else if (d<d2){d2=d;l2=f.keypoints[k].level;}
    });
    if (best<0||d1>o.max_distance) continue;
    if (l1==l2 && d1>o.ratio*d2) continue;
    if (d1<dist[best]) { if (owner[best]>=0) out[owner[best]]=-1; owner[best]=i; dist[best]=d1; out[i]=best; }
  }
  return out;
}
std::vector<std::pair<int,int>> match_brute_force(const Features& a, const Features& b, const MatchOptions& o) {
  std::vector<std::pair<int,int>> r;
  std::vector<int> bb(b.size(),-1), bd(b.size(),999);
  std::vector<int> ab(a.size(),-1);
  for (size_t i=0;i<a.size();++i) { int d1=999,d2=999,k=-1; for (size_t j=0;j<b.size();++j){int d=hamming_distance(a.descriptors[i],b.descriptors[j]); if(d<d1){d2=d1;d1=d;k=j;} else if(d<d2)d2=d; if(d<bd[j]){bd[j]=d;bb[j]=i;}}
    if (k>=0&&d1<=o.max_distance&&d1<o.ratio*d2) ab[i]=k; }
  for (size_t i=0;i<a.size();++i) if(ab[i]>=0&&bb[ab[i]]==(int)i) r.push_back({(int)i,ab[i]});
  return r;
}
}
