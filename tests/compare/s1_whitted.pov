// Scene S1 for POV-Ray 3.7: the same numbers as scripts/reference/s1_whitted.lua.
// Right-handed world, y upwards: the negative 'right' undoes POV-Ray's left-handed default.
#version 3.7;
global_settings { assumed_gamma 1.0 max_trace_level 8 }
background { rgb <0.25, 0.40, 0.70> }
camera { perspective location <0, 3.5, 11> right -x*4/3 up y angle 45 look_at <0, 0.8, 0> }
light_source { <-6, 9, 6> rgb <0.60, 0.60, 0.60> }
light_source { <7, 8, 3> rgb <0.40, 0.38, 0.35> }

#declare Matte = finish { ambient 0 emission 0 diffuse 1 specular 0 phong 0 }
#declare Mirror = texture { pigment { rgb 0 } finish { ambient 0 diffuse 0 specular 0 reflection { rgb 0.9 } } }
#declare Glass = texture {
  pigment { rgbt <1, 1, 1, 1> }
  finish { ambient 0 diffuse 0 specular 0 reflection { 0, 1 fresnel on } conserve_energy }
}
// Shifted by half a cell in y, so that rounding at y = 0 cannot choose between two cells.
plane { y, 0 texture { pigment { checker rgb 0.8 rgb 0.2 translate -0.5*y } finish { Matte } } }

#declare I = 0;
#while (I < 30)
  #declare R = 0.30 + 0.10*mod(I, 4);
  #declare Rho = 0.95*sqrt(I + 0.5);
  #declare T = 2.399963*I;
  #declare K = int(I/3);
  sphere {
    <Rho*cos(T), R, Rho*sin(T)>, R
    #switch (mod(I, 3))
      #case (0) texture { pigment { rgb <0.5 + 0.4*cos(K), 0.5 + 0.4*cos(K + 2*pi/3), 0.5 + 0.4*cos(K + 4*pi/3)> } finish { Matte } } #break
      #case (1) texture { Mirror } #break
      #case (2) texture { Glass } interior { ior 1.5 } #break
    #end
  }
  #declare I = I + 1;
#end
sphere { <-4.5, 1.6, -6.5>, 1.6 texture { Mirror } }
sphere { <1.2, 1.9, 2.5>, 0.6 texture { Glass } interior { ior 1.5 } }
