"""What a scene file may say, as comments to start one with."""

GUIDE = """\
# A scene for atmos. Lengths are in m, wavelengths in nm, coefficients in 1/m, angles in
# degrees. Nothing is left of a medium above `top`.
#
# [planet]   shape = "spherical" (with a `radius`) or "flat". ground_albedo: a spectrum,
#            or "grass", "soil", "sand", "snow", "sea", "asphalt", "concrete", "mars".
# [sun]      zenith: the angle from straight up; azimuth: clockwise from north.
#            irradiance: a spectrum, in W m^-2 nm^-1 on a plane that faces the sun, or
#            { kind = "solar", bandwidth, distance }: the real one, averaged over bands
#            of so many nm, at a distance in astronomical units. With angular_radius 0
#            it is a point. Several suns: [[sun]] instead, one after the other.
# [[light]]  Any number of them, beside suns or without one; for `atmos render`.
#            { kind = "lamp", position, intensity }: to all sides; the intensity is a
#            spectrum, in W sr^-1 nm^-1. What shines from a place is not seen itself.
#            { kind = "spot", position, direction, intensity, inner, outer }: a cone
#            around a direction, [east, north, up]; as bright up to the angle `inner`
#            from it, then less and less, and dark from the angle `outer` on.
#            { kind = "surrounding", file, centre_azimuth }: a picture of all directions
#            behind the world, in a spectral OpenEXR file twice as wide as high.
# [[surface]] Any number of them, a shape of a material; for `atmos render`.
#   shape    { kind = "sphere", centre, radius }
#            { kind = "plane", place, upright }: without end; level without `upright`
#   material { kind = "lambertian", albedo }: a spectrum or a name, as of the ground
#            { kind = "mirror", reflectance }
#            { kind = "glass", index }: clear; 1.5 without an index
# [[medium]] Any number of them. `scattering`, `absorption` or both; or `extinction` and
#            `single_scattering_albedo`. They are spectra, where the profile is 1.
#   profile  { kind = "exponential", scale_height }
#            { kind = "tent", centre, half_width }
#            { kind = "uniform", bottom, top }
#            { kind = "table", altitude, value }: straight lines, and nothing outside
#            { kind = "standard_atmosphere" }: the air of 1976, 1 at the ground
#            { kind = "height_fog", top, scale_height }: 1 up to the top
#            { kind = "everywhere" }
#            { kind = "ball", centre, radius }
#            { kind = "box", lower, upper }
#            { kind = "grid", values, lower, upper }: values[x][y][z] in a box
#            { kind = "file", file, grid, factor }: a grid by its name in an OpenVDB
#            file (.vdb) or a NumPy archive (.npz, with arrays `lower` and `upper`)
#            { kind = "noise", size, level, softness, octaves, seed }: clouds, 0 to 1
#            { kind = "puff", centre, radius, size, roughness, softness, octaves, seed }
#            { kind = "transformed", of, matrix, offset }: `of` is a profile, `matrix`
#            has three rows of three numbers
#            { kind = "product", one, other }: of two profiles, to bound noise by a box
#            { kind = "sampled", of, lower, upper, cells }: a grid, of so many cells
#            along x, y and z of a box, of a profile: quicker than noise
#   phase    { kind = "isotropic" }
#            { kind = "rayleigh", depolarisation }
#            { kind = "henyey_greenstein", g }
#            { kind = "double_henyey_greenstein", forward, backward, weight }
#            { kind = "cornette_shanks", g }
#            { kind = "draine", g, alpha }
#            { kind = "empirical_mie", z }
#            { kind = "table", cosine, value }: relative, cosines from -1 to 1; with a
#            list `wavelength`, each `value` is a list, a number for each of these
# Spectra    A number; { kind = "power_law", value, exponent, at }; or
#            { kind = "table", wavelength, value, outside }: straight lines, and beyond
#            them outside = "refuse", "zero" or "hold", or numbers, `below` and `above`.
#            { kind = "molecules", gas = "air" or "carbon_dioxide", number_density } is
#            a `scattering`, and without number_density (1/m^3) a `depolarisation`.
#            { kind = "ozone", number_density } is an `absorption`.
# Emission   A medium with an `emission` shines: a spectrum, in W m^-2 sr^-1 nm^-1 per m
#            where the profile is 1; or { kind = "blackbody", temperature }: a profile
#            in K; it shines as it absorbs.
# Colour     A medium with an `extinction` and a profile of kind "file" may have a
#            `colour`: the name of a grid of red, green and blue in the same file, the
#            share that scatters.
# Camera     [camera] says what pictures show, if there is one; options may change it.
#            { kind = "perspective", position, azimuth, elevation, field_of_view,
#            height, width }: from side to side, in degrees, and pixels;
#            { kind = "latlong", position, height, centre_azimuth }: all directions;
#            { kind = "fisheye", position, height, angle_of_view, top_azimuth }
# Presets    A medium may be as short as this: preset = "air"; preset = "ozone", with a
#            `column` in Dobson units; preset = "continental_clean" or another aerosol
#            (see `atmos sky --help`), with an `optical_depth` or a `visibility`.
"""
