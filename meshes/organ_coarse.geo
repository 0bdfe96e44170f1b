// organ_coarse.geo - organ.geo with edges of 7.5 mm: about 10,000 tets, few enough to be moved by hand in real time.
size = 0.0075;
Include "organ.geo";
